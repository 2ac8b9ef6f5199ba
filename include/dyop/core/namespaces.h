// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Each room keeps its private code in a namespace of its own, `dyop::<room>_internal`, and sees the
// private names of the rooms below it on the ladder. Rooms side by side do not see each other, so
// two private types of one name are two types for the linker, too.

namespace dyop {

// clang-format off
namespace core_internal {}
namespace exact_internal     { using namespace core_internal; }
namespace hierarchy_internal { using namespace exact_internal; }
namespace geometry_internal  { using namespace hierarchy_internal; }
namespace motion_internal    { using namespace hierarchy_internal; }
namespace distance_internal  { using namespace geometry_internal; using namespace motion_internal; }
namespace paper_internal     { using namespace distance_internal; }
namespace toi_internal       { using namespace distance_internal; }
namespace contact_internal   { using namespace toi_internal; }
namespace chain_internal     { using namespace toi_internal; }
namespace dynamics_internal  { using namespace contact_internal; }
namespace haptics_internal   { using namespace contact_internal; }
namespace ompl_internal      { using namespace chain_internal; }
namespace io_internal        { using namespace chain_internal; using namespace dynamics_internal;
                               using namespace haptics_internal; }
namespace view_internal      { using namespace io_internal; }
// clang-format on

}  // namespace dyop

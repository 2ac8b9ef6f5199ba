#include "dyop/toi/toi_workspace.h"

#include "toi/toi_memory.h"

namespace dyop {

ToiWorkspace::ToiWorkspace() : memory_(std::make_unique<internal::ToiMemory>()) {}
ToiWorkspace::~ToiWorkspace() = default;
ToiWorkspace::ToiWorkspace(ToiWorkspace&&) noexcept = default;
ToiWorkspace& ToiWorkspace::operator=(ToiWorkspace&&) noexcept = default;

bool ToiWorkspace::can_resume() const {
  return memory_->is_unfinished;
}

}  // namespace dyop

// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of MoveIt 2.12 with just what the adapter and its tests use.
#pragma once

#include <memory>

#define MOVEIT_CLASS_FORWARD(C)                 \
  class C;                                      \
  using C##Ptr = std::shared_ptr<C>;            \
  using C##ConstPtr = std::shared_ptr<const C>; \
  using C##WeakPtr = std::weak_ptr<C>;          \
  using C##ConstWeakPtr = std::weak_ptr<const C>

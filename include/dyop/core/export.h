// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/namespaces.h"

/// Marks what a shared library of dyop exports. Used once per public header, at its namespace:
///
///     namespace DYOP_EXPORT dyop {
///
/// Everything declared there is visible, so nothing can be forgotten; everything else is hidden. A
/// private function that another dyop library calls carries the macro itself. g++ applies the
/// attribute of a namespace to later definitions of what was declared in it; clang++ does not, so
/// shared libraries built with clang++ export everything.
#define DYOP_EXPORT [[gnu::visibility("default")]]

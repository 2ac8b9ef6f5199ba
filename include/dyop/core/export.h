#pragma once

/// What a shared library of dyop shows. It stands once per public header, at its namespace:
///
///     namespace DYOP_EXPORT dyop {
///
/// so that everything declared there is visible, and nothing can be forgotten; all else is hidden.
/// A private function that another library of dyop calls carries it by itself. g++ applies the
/// attribute of a namespace to later definitions of what was declared in it; clang++ does not, so
/// there shared libraries show everything.
#define DYOP_EXPORT [[gnu::visibility("default")]]

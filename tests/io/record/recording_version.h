// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>

#include "io/record/hdf5_file.h"

namespace dyop::testing {

/// Overwrites the version of the format that a recording states.
inline void set_version(const std::filesystem::path& file, std::int64_t version) {
  const io_internal::Hdf5Handle opened(H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), &H5Fclose);
  const io_internal::Hdf5Handle attribute(H5Aopen(opened.get(), "version", H5P_DEFAULT), &H5Aclose);
  ASSERT_GE(H5Awrite(attribute.get(), H5T_NATIVE_INT64, &version), 0);
}

}  // namespace dyop::testing

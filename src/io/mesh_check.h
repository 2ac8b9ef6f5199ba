#pragma once

#include <filesystem>
#include <string_view>

namespace dyop::internal {

/// Throws FileError if the bytes of a mesh file are damaged in a way that assimp would repair or
/// ignore silently: numbers that are not finite, indices out of range, truncation.
void check_obj(const std::filesystem::path& file, std::string_view bytes);
void check_off(const std::filesystem::path& file, std::string_view bytes);
void check_stl(const std::filesystem::path& file, std::string_view bytes);
void check_ply(const std::filesystem::path& file, std::string_view bytes);

}  // namespace dyop::internal

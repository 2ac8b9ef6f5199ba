// SPDX-License-Identifier: BSD-3-Clause
#include "cli/picture/picture_file.h"

#include "dyop/io/file_error.h"
#include "io/output_file.h"

namespace dyop::cli {
namespace {

std::string page_of(const std::string& svg) {
  return "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width\">\n<title>dyop</title>\n"
         "<style>body{margin:0;background:#fff}svg{display:block;margin:auto;max-width:100%;"
         "height:auto}</style>\n</head>\n<body>\n" +
         svg + "</body>\n</html>\n";
}

}  // namespace

void require_picture(const std::filesystem::path& file) {
  const std::filesystem::path ending = file.extension();
  if (ending == ".png") {
    png_of(file, "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"1\" height=\"1\"/>");
  } else if (ending != ".svg" && ending != ".html") {
    throw FileError(file, "expected a picture .svg, .png or .html");
  }
}

void write_picture(const std::filesystem::path& file, const std::string& svg) {
  std::string bytes = svg;
  if (file.extension() == ".png") bytes = png_of(file, svg);
  if (file.extension() == ".html") bytes = page_of(svg);
  io_internal::write_whole_file(file, bytes);
}

}  // namespace dyop::cli

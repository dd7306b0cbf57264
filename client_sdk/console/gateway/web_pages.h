// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace carillon::console {

/// A file that the program has within it.
struct WebPage {
  std::string_view path;          ///< As the browser asks for it, such as "/main.js".
  std::string_view content_type;  ///< The value of the header Content-Type.
  std::string_view bytes;         ///< The content, compressed by gzip.
};

/// Returns the file at `path`, or null. "/" is the page.
const WebPage* FindWebPage(std::string_view path);

/// Returns the page that shows and plays a trace, which lacks the trace. It is not compressed.
std::string_view TracePage();

}  // namespace carillon::console

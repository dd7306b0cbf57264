// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/console/gateway/web_pages.h"

#include <array>
#include <cstddef>

namespace carillon::console {
namespace {

/// Takes a file of the folder CARILLON_CONSOLE_PAGES into the program, from `begin` to `end`.
#define CARILLON_EMBED(symbol, file)                                                            \
  __asm__(".pushsection .rodata\n.global carillon_" #symbol "_begin\n.global carillon_" #symbol \
          "_end\ncarillon_" #symbol "_begin:\n.incbin \"" CARILLON_CONSOLE_PAGES "/" file       \
          "\"\ncarillon_" #symbol "_end:\n.byte 0\n.popsection\n");                             \
  extern "C" const char carillon_##symbol##_begin[];                                            \
  extern "C" const char carillon_##symbol##_end[]

CARILLON_EMBED(index_html, "index.html.gz");
CARILLON_EMBED(style_css, "style.css.gz");
CARILLON_EMBED(main_js, "main.js.gz");
CARILLON_EMBED(listen_worker_js, "listen_worker.js.gz");
CARILLON_EMBED(shared_js, "shared.js.gz");
CARILLON_EMBED(player_worklet_js, "player_worklet.js.gz");
CARILLON_EMBED(licences_txt, "licences.txt.gz");
CARILLON_EMBED(trace_file_html, "trace_file.html");

#undef CARILLON_EMBED

std::string_view Between(const char* begin, const char* end) {
  return {begin, static_cast<size_t>(end - begin)};
}

constexpr std::string_view kScript = "text/javascript; charset=utf-8";

}  // namespace

const WebPage* FindWebPage(std::string_view path) {
  static const std::array pages{
      WebPage{"/", "text/html; charset=utf-8",
              Between(carillon_index_html_begin, carillon_index_html_end)},
      WebPage{"/style.css", "text/css; charset=utf-8",
              Between(carillon_style_css_begin, carillon_style_css_end)},
      WebPage{"/main.js", kScript, Between(carillon_main_js_begin, carillon_main_js_end)},
      WebPage{"/listen_worker.js", kScript,
              Between(carillon_listen_worker_js_begin, carillon_listen_worker_js_end)},
      WebPage{"/shared.js", kScript, Between(carillon_shared_js_begin, carillon_shared_js_end)},
      WebPage{"/licences.txt", "text/plain; charset=utf-8",
              Between(carillon_licences_txt_begin, carillon_licences_txt_end)},
      WebPage{"/player_worklet.js", kScript,
              Between(carillon_player_worklet_js_begin, carillon_player_worklet_js_end)},
  };
  for (const WebPage& page : pages) {
    if (page.path == path) return &page;
  }
  return nullptr;
}

std::string_view TracePage() {
  return Between(carillon_trace_file_html_begin, carillon_trace_file_html_end);
}

}  // namespace carillon::console

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace carillon::console {

/// Decides who may use the console. A port of the loopback interface is open to every user and to
/// every web page of the machine, unlike a Unix socket; the token, the cookie, and the checks of
/// Host and Origin restore what the socket had.
class Admission {
 public:
  /// Makes a token and the value of the cookie, 256 random bits each. `port` is the one at which
  /// the browser sees the console; the cookie has its name by the port, because browsers send
  /// cookies to all ports of a host.
  explicit Admission(uint16_t port);

  /// The token of the address that the program prints.
  const std::string& token() const { return token_; }

  /// Whether `given` is the token. The comparison takes the same time for each wrong token.
  bool IsToken(std::string_view given) const;

  /// The value of the header Set-Cookie, for a browser that has shown the token.
  std::string SetCookie() const;

  /// Whether the header Cookie has the cookie.
  bool HasCookie(std::string_view cookies) const;

  /// Whether the header Host is a name of this machine's loopback interface. Other names are those
  /// of a page that had its name pointed here (DNS rebinding).
  static bool IsOwnHost(std::string_view host);

  /// Whether a page of `origin` (the header Origin) is the console itself, which is served at
  /// `host`. Browsers let pages of every origin open WebSockets.
  static bool IsOwnOrigin(std::string_view origin, std::string_view host);

 private:
  std::string token_;
  std::string cookie_name_;
  std::string cookie_;
};

}  // namespace carillon::console

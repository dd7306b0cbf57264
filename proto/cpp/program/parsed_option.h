// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

namespace carillon {

/// Adds an option. `parse` converts its text to a value, which `take` gets. `form` describes the
/// right text in the message about a wrong text.
template <class T, class Take>
CLI::Option* AddParsed(CLI::App& app, const std::string& name,
                       std::optional<T> (*parse)(const std::string&), const std::string& form,
                       const std::string& description, Take take) {
  return app.add_option_function<std::string>(
      name,
      [=](const std::string& text) {
        const std::optional<T> value = parse(text);
        if (!value) throw CLI::ValidationError(name, "\"" + text + "\" must be " + form);
        take(*value);
      },
      description);
}

}  // namespace carillon

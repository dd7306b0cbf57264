// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace carillon::cli {

/// A closed surface: vertices in metres, and triangles counter-clockwise from outside.
struct ExampleBody {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;
};

/// A body that ships with the program, with the options that make it sound.
struct Example {
  std::string name;
  std::string description;
  std::string material;
  std::string strike;  ///< options of `carillon strike`
  ExampleBody (*draw)();
};

/// All examples: bell, bowl, bar and chime.
const std::vector<Example>& Examples();

/// Returns the surface as an OBJ file.
std::string ObjText(const Example& example);

}  // namespace carillon::cli

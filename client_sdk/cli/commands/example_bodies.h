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

/// A body that ships with the program, with a material and a strike that make it sound.
struct Example {
  std::string name;
  std::string description;
  std::string material;
  std::array<double, 3> point_m;  ///< the struck point of the body in its file
  std::string impulse;            ///< the impulse that the strike gives the body, N s
  ExampleBody (*draw)();
};

/// All examples: bell, bowl, bar and chime.
const std::vector<Example>& Examples();

/// What an example is written as.
struct ExampleFile {
  std::string obj;
  std::string strike;  ///< options of `carillon strike`
};

/// Returns the surface as an OBJ file and the strike. `size_m` has the lengths along x, y and z,
/// metres, to which the body is stretched. If `size_m` is empty, the body keeps its size.
ExampleFile WrittenExample(const Example& example, const std::vector<double>& size_m);

}  // namespace carillon::cli

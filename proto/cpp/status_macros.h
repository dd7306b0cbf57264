// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

/// RETURN_IF_ERROR(expression) evaluates an expression of type absl::Status once, and returns the
/// status from the enclosing function if it is an error. It is one statement, so it can stand alone
/// below an `if` or an `else`. Commas in the expression need no parentheses.
#define RETURN_IF_ERROR(...) \
  STATUS_MACROS_RETURN_IF_ERROR(STATUS_MACROS_JOIN(status_, __COUNTER__), __VA_ARGS__)

/// ASSIGN_OR_RETURN(target, expression) evaluates an expression of type absl::StatusOr<T> once. On
/// success it moves the value into `target`, a declaration or an assignable expression. On error it
/// returns the status from the enclosing function.
///
///     ASSIGN_OR_RETURN(const TetMesh mesh, Tetrahedralize(surface));
///     ASSIGN_OR_RETURN(mesh_, Tetrahedralize(surface));
///     ASSIGN_OR_RETURN((const std::map<int, Mesh> meshes), ReadMeshes());
///     ASSIGN_OR_RETURN((const auto [nodes, elements]), CountParts(surface));
///
/// A target with a comma in it stands in parentheses. Commas in the expression need no parentheses.
/// A target that is a const reference refers to the value without moving it, for the rest of the
/// scope. The macro is several statements, so it cannot stand alone below an `if`.
#define ASSIGN_OR_RETURN(target, ...) \
  STATUS_MACROS_ASSIGN_OR_RETURN(STATUS_MACROS_JOIN(status_or_, __COUNTER__), target, __VA_ARGS__)

// The macros below are internal to the two macros above.

#define STATUS_MACROS_RETURN_IF_ERROR(status, ...)                        \
  do {                                                                    \
    if (absl::Status status = (__VA_ARGS__); !status.ok()) return status; \
  } while (false)

#define STATUS_MACROS_ASSIGN_OR_RETURN(status_or, target, ...) \
  auto status_or = (__VA_ARGS__);                              \
  if (!status_or.ok()) return std::move(status_or).status();   \
  STATUS_MACROS_WITHOUT_PARENTHESES(target) = *std::move(status_or)

#define STATUS_MACROS_JOIN(a, b) STATUS_MACROS_JOIN_EXPANDED(a, b)
#define STATUS_MACROS_JOIN_EXPANDED(a, b) a##b

// Removes the parentheses around `x`, if there are any. "MARK (a, b)" expands to "MARK a, b", and
// "MARK a" stays as it is. Joining "REMOVE_" with MARK then gives REMOVE_..._MARK, which is empty.
#define STATUS_MACROS_WITHOUT_PARENTHESES(x) STATUS_MACROS_REMOVE(STATUS_MACROS_MARK x)
#define STATUS_MACROS_MARK(...) STATUS_MACROS_MARK __VA_ARGS__
#define STATUS_MACROS_REMOVE(...) STATUS_MACROS_REMOVE_EXPANDED(__VA_ARGS__)
#define STATUS_MACROS_REMOVE_EXPANDED(...) REMOVE_##__VA_ARGS__
#define REMOVE_STATUS_MACROS_MARK

// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// Returns a weight from 1 to 4 for each node of the mesh. The weight says how much more of the
/// error remains near the node, if elements are one order higher, than remains where the
/// displacement is smooth.
///
/// At a re-entrant edge, whose faces enclose more than 180 degrees of the body, the stress is
/// singular (Grisvard, Elliptic Problems in Nonsmooth Domains, 1985). If the displacement grows as
/// the power a of the distance from the edge, elements of order p + 1 in place of p lessen the
/// error to (p / (p + 1))^(4 a) (Babuska and Suri, SIAM Review 36, 1994). With the exponents of
/// elastic wedges the remaining part rises about as the square root of the re-entrant angle, to 2
/// where the body encloses 270 degrees.
///
/// A fillet that turns by a right angle within a few elements acts like an edge. Its remaining part
/// rises with the angle by which the boundary turns within the length of two elements' edges. This
/// dependence was fitted to an angle with a fillet.
///
/// Quadratic elements that are much wider than a flat wall is thick lock in bending. A correction
/// by functions of the next order, with the mode's own displacement left as it is, is then only a
/// part of the error, the smaller the flatter the elements are: about a half at a width of four
/// thicknesses and a quarter at eight. The weight is a power of the least aspect (longest edge over
/// least height) of the elements at the node. It was fitted to discs. Facets of curved walls need
/// no such weight, because their edges are bent.
///
/// The weight of a node is the largest of its weights by edges, by fillets and by flat walls. It is
/// 1 inside a solid, on its plane and convex parts, and at mid-side nodes.
std::vector<double> PlaceWeights(const TetMesh& mesh);

}  // namespace carillon::precompute

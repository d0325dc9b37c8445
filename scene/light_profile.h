// How much a lamp sends to each direction, as its maker measured it.
#pragma once

#include <string>
#include <vector>

namespace lumel {

/// A table of intensities by two angles, relative to the greatest. Vertical angles are those from where the lamp points
/// (down, for most), horizontal ones those about this axis. What the table leaves out is dark.
struct LightProfile {
  std::vector<float> verticals;    // degrees in [0, 180], ascending, at least two
  std::vector<float> horizontals;  // degrees, ascending, from 0 to 360; one entry: the same all around
  std::vector<float> shares;       // verticals.size() for each horizontal angle; 0..1
  float mostCandela = 0.0f;        // that the file gives for share 1
  std::string text;                // of the file

  /// Returns the share towards a unit vector given by its parts along the axes C = 0, C = 90 and the lamp's own,
  /// bilinear in the angles.
  float share(float right, float up, float forward) const;

  /// Returns the integral of the share over all directions in steradians, by the midpoint rule in half degrees.
  double solidAngle() const;
};

}  // namespace lumel

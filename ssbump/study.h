// What block compression and mip levels do to an ssbump map: errors of weights, lighting and recovered normals.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/base/expected.h"
#include "scene/base/progress.h"
#include "scene/image.h"

namespace lumel::ssbump {

/// One way to store a map, at one mip level, against the unquantised level.
struct StudyRow {
  std::string format;
  int mip = 0;
  double bitsPerTexel = 0;
  double weightRmse = 0, weightMax = 0;               // of the three squared weights
  double lightRmse = 0, lightMax = 0;                 // over 16 light directions, light 1 on a flat texel that faces it
  double normalMeanDegrees = 0, normal99Degrees = 0;  // recovered normals; 99: the 99th percentile
};

/// Formats: RGB8 and RGB565, in squared and in linear weights (the square roots spread small weights over more steps);
/// BC1 in both; BC3 split (one weight in the alpha block, two in the colour block), 8 bits per texel as BC7 has;
/// BC5 + BC4, one 4-bit block per weight. Neither libsquish nor NVTT 2.0 has BC7.
/// `map`: squared weights, right-handed, three channels. Mips 0 to `lastMip` (box filter).
/// `progress` advances by texels and formats; once it is cancelled rows are missing: ask it.
std::vector<StudyRow> studyFormats(const Image& map, int lastMip, Progress& progress = noProgress());

/// A mip level's recovered normals against the mean of the full map's, and its lighting against the mean lighting of
/// the texels below it (equal for a box filter: lighting is linear in the weights).
struct MipRow {
  int mip = 0;
  double lightRmse = 0;
  double normalMeanDegrees = 0;
};
std::vector<MipRow> studyMips(const Image& map, int lastMip, const Progress& progress = noProgress());

/// Writes study.md (both tables), and study.png: a row of panels per format of mip 0: weights, error times 8, lit from
/// the right, recovered normals. Errors: Failed, Interrupted.
Expected<void> writeStudy(const Image& map, const std::string& title, const std::filesystem::path& folder,
                          Progress& progress = noProgress());

}  // namespace lumel::ssbump

#include "ssbump/study.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numeric>

#include "scene/images/image_io.h"
#include "ssbump/contact_sheet.h"
#include "ssbump/maps/block_compression.h"
#include "ssbump/maps/mip.h"
#include "ssbump/maps/weights.h"

namespace lumel::ssbump {
namespace {

struct Format {
  const char* name;
  double bits;
  Convention stored;
  std::function<Image(const Image&, const Progress&)> roundTrip;  // of the stored values
};

Image mapTexels(const Image& in, const std::function<Vec3(const Vec3&)>& f) {
  Image out(in.width, in.height, 3);
  for (int y = 0; y < in.height; ++y)
    for (int x = 0; x < in.width; ++x) out.setRgb(x, y, f(in.rgb(x, y)));
  return out;
}

Image quantise(const Image& in, const Vec3& steps) {
  return mapTexels(in, [&](const Vec3& s) { return glm::round(glm::clamp(s, 0.0f, 1.0f) * steps) / steps; });
}

Image throughBlocks(const Image& in, BlockFormat format, const Progress& progress) {
  return decompressBlocks(compressBlocks(in, format, progress), in.width, in.height, format);
}

Image dropAlpha(const Image& in) {
  return mapTexels(in, [](const Vec3& s) { return s; });
}

/// One weight in the alpha block, whose eight levels are its own; the colour block's line is left with two.
Image throughSplit(const Image& in, const Progress& progress) {
  Image packed(in.width, in.height, 4);
  for (int y = 0; y < in.height; ++y)
    for (int x = 0; x < in.width; ++x) {
      const Vec3 s = in.rgb(x, y);
      const Vec4 texel(s.x, s.z, 0, s.y);
      std::copy_n(&texel.x, 4, packed.at(x, y));
    }
  const Image back = throughBlocks(packed, BlockFormat::Bc3, progress);
  Image out(in.width, in.height, 3);
  for (int y = 0; y < in.height; ++y)
    for (int x = 0; x < in.width; ++x) out.setRgb(x, y, {back.at(x, y)[0], back.at(x, y)[3], back.at(x, y)[1]});
  return out;
}

Image throughThreeBlocks(const Image& in, const Progress& progress) {
  Image two(in.width, in.height, 3), one(in.width, in.height, 1);
  for (int y = 0; y < in.height; ++y)
    for (int x = 0; x < in.width; ++x) {
      const Vec3 s = in.rgb(x, y);
      two.setRgb(x, y, {s.x, s.y, 0});
      *one.at(x, y) = s.z;
    }
  const Image a = throughBlocks(two, BlockFormat::Bc5, progress), b = throughBlocks(one, BlockFormat::Bc4, progress);
  Image out(in.width, in.height, 3);
  for (int y = 0; y < in.height; ++y)
    for (int x = 0; x < in.width; ++x) out.setRgb(x, y, {a.at(x, y)[0], a.at(x, y)[1], b.at(x, y)[0]});
  return out;
}

std::vector<Format> formats() {
  const auto rgb8 = [](const Image& i, const Progress&) { return quantise(i, Vec3(255)); };
  const auto rgb565 = [](const Image& i, const Progress&) { return quantise(i, Vec3(31, 63, 31)); };
  const auto bc1 = [](const Image& i, const Progress& p) { return dropAlpha(throughBlocks(i, BlockFormat::Bc1, p)); };
  return {{"RGB8", 24, Convention::Squared, rgb8},
          {"RGB8 linear", 24, Convention::Linear, rgb8},
          {"RGB565", 16, Convention::Squared, rgb565},
          {"RGB565 linear", 16, Convention::Linear, rgb565},
          {"BC5 + BC4", 12, Convention::Squared, throughThreeBlocks},
          {"BC5 + BC4 linear", 12, Convention::Linear, throughThreeBlocks},
          {"BC3 split", 8, Convention::Squared, throughSplit},
          {"BC3 split linear", 8, Convention::Linear, throughSplit},
          {"BC1", 4, Convention::Squared, bc1},
          {"BC1 linear", 4, Convention::Linear, bc1}};
}

Image storedAndBack(const Image& map, const Format& format, const Progress& progress) {
  Image stored = map;
  convert(stored, {}, {format.stored, Hand::Right});
  Image back = format.roundTrip(stored, progress);
  convert(back, {format.stored, Hand::Right}, {});
  return back;
}

/// Sixteen lights: four azimuths off the axes at four elevations.
std::vector<Vec3> lights() {
  std::vector<Vec3> all;
  for (int e = 0; e < 4; ++e)
    for (int a = 0; a < 4; ++a) {
      const float elevation = (static_cast<float>(e) + 0.5f) * kPi / 8,
                  azimuth = (static_cast<float>(a) + 0.3f + 0.25f * static_cast<float>(e)) * kPi / 2;
      all.emplace_back(std::cos(azimuth) * std::cos(elevation), std::sin(azimuth) * std::cos(elevation),
                       std::sin(elevation));
    }
  return all;
}

double degreesBetween(const Vec3& a, const Vec3& b) {
  // The chord tells small angles exactly, which the arc cosine does not.
  return 2 * std::asin(std::min(1.0, 0.5 * static_cast<double>(glm::length(a - b)))) * 180 / std::numbers::pi;
}

StudyRow compare(const Image& truth, const Image& other, Progress& progress) {
  StudyRow row;
  const std::vector<Vec3> directions = lights();
  std::vector<double> angles;
  double weights = 0, light = 0;
  for (int y = 0; y < truth.height; ++y) {
    if (progress.cancelled()) return row;
    for (int x = 0; x < truth.width; ++x) {
      const Vec3 a = truth.rgb(x, y), b = other.rgb(x, y);
      for (int c = 0; c < 3; ++c) {
        const double d = static_cast<double>(b[c]) - static_cast<double>(a[c]);
        weights += d * d;
        row.weightMax = std::max(row.weightMax, std::abs(d));
      }
      for (const Vec3& l : directions) {
        // A flat open texel that faces the light gives 1/3: scaled so that this is 1.
        const double d = 3 * (static_cast<double>(litBy(b, l)) - static_cast<double>(litBy(a, l)));
        light += d * d;
        row.lightMax = std::max(row.lightMax, std::abs(d));
      }
      angles.push_back(degreesBetween(recoveredNormal(a), recoveredNormal(b)));
    }
    progress.advance(static_cast<std::uint64_t>(truth.width));
  }
  const double texels = static_cast<double>(angles.size());
  row.weightRmse = std::sqrt(weights / (3 * texels));
  row.lightRmse = std::sqrt(light / (static_cast<double>(directions.size()) * texels));
  row.normalMeanDegrees = std::accumulate(angles.begin(), angles.end(), 0.0) / texels;
  auto high = angles.begin() + static_cast<std::ptrdiff_t>(angles.size() * 99 / 100);
  std::nth_element(angles.begin(), high, angles.end());
  row.normal99Degrees = *high;
  return row;
}

std::vector<Image> levelsTo(const Image& map, int lastMip) {
  std::vector<Image> levels{map};
  while (static_cast<int>(levels.size()) <= lastMip && (levels.back().width > 1 || levels.back().height > 1))
    levels.push_back(halve(levels.back(), MipFilter::Box, true));
  return levels;
}

std::string table(const std::vector<StudyRow>& rows, const std::vector<MipRow>& mips, const std::string& title) {
  std::string text = "# Compression study: " + title +
                     "\n\n| format | bits | mip | weight rmse | max | light rmse | max | normal mean deg | 99% |\n"
                     "|---|---|---|---|---|---|---|---|---|\n";
  std::array<char, 256> line{};
  for (const StudyRow& r : rows) {
    std::snprintf(line.data(), line.size(), "| %s | %g | %d | %.5f | %.4f | %.5f | %.4f | %.3f | %.3f |\n",
                  r.format.c_str(), r.bitsPerTexel, r.mip, r.weightRmse, r.weightMax, r.lightRmse, r.lightMax,
                  r.normalMeanDegrees, r.normal99Degrees);
    text += line.data();
  }
  text +=
      "\n| mip | light rmse against the mean of mip 0 | recovered normal against the mean normal, mean deg "
      "|\n|---|---|---|\n";
  for (const MipRow& r : mips) {
    std::snprintf(line.data(), line.size(), "| %d | %.6f | %.3f |\n", r.mip, r.lightRmse, r.normalMeanDegrees);
    text += line.data();
  }
  return text;
}

Image studyPicture(const Image& map, const Progress& progress) {
  const int w = std::min(map.width, 256), h = std::min(map.height, 256);
  Image crop(w, h, 3);
  for (int y = 0; y < h; ++y) std::copy_n(map.at(0, y), w * 3, crop.at(0, y));
  const Vec3 right = glm::normalize(Vec3(1, 0, 0.5f));
  std::vector<Image> panels;
  for (const Format& format : formats()) {
    const Image back = storedAndBack(crop, format, progress);
    Image error(w, h, 3);
    for (std::size_t i = 0; i < error.pixels.size(); ++i)
      error.pixels[i] = 8 * std::abs(back.pixels[i] - crop.pixels[i]);
    panels.push_back(mapTexels(back, [](const Vec3& s) { return s * 1.5f; }));
    panels.push_back(std::move(error));
    panels.push_back(mapTexels(back, [&](const Vec3& s) { return Vec3(litBy(s, right)); }));
    panels.push_back(mapTexels(back, [](const Vec3& s) { return encodeNormal(recoveredNormal(s), Green::Up); }));
  }
  return panelGrid(panels, 4);
}

}  // namespace

std::vector<StudyRow> studyFormats(const Image& map, int lastMip, Progress& progress) {
  const std::vector<Image> levels = levelsTo(map, lastMip);
  std::vector<StudyRow> rows;
  std::uint64_t texels = 0;
  for (const Image& level : levels) texels += level.pixels.size() / 3;
  progress.begin("study", texels * formats().size());
  for (const Format& format : formats())
    for (std::size_t mip = 0; mip < levels.size() && !progress.cancelled(); ++mip) {
      StudyRow row = compare(levels[mip], storedAndBack(levels[mip], format, progress), progress);
      row.format = format.name;
      row.bitsPerTexel = format.bits;
      row.mip = static_cast<int>(mip);
      rows.push_back(row);
    }
  progress.end();
  return rows;
}

std::vector<MipRow> studyMips(const Image& map, int lastMip, const Progress& progress) {
  const std::vector<Image> levels = levelsTo(map, lastMip);
  const auto texels = [&](std::size_t mip) { return static_cast<double>(levels[mip].pixels.size() / 3); };
  std::vector<MipRow> rows(levels.size() - 1);
  Image normals = mapTexels(map, [](const Vec3& s) { return recoveredNormal(s); });
  for (std::size_t mip = 1; mip < levels.size(); ++mip) {
    const Image& level = levels[mip];
    normals = halve(normals, MipFilter::Box, true);
    MipRow& row = rows[mip - 1];
    row.mip = static_cast<int>(mip);
    for (int y = 0; y < level.height; ++y)
      for (int x = 0; x < level.width; ++x)
        row.normalMeanDegrees += degreesBetween(recoveredNormal(level.rgb(x, y)), glm::normalize(normals.rgb(x, y)));
    row.normalMeanDegrees /= texels(mip);
  }
  const std::vector<Vec3> directions = lights();
  for (const Vec3& l : directions) {
    const auto light = [&](const Image& level) {
      Image lit(level.width, level.height, 1);
      for (int y = 0; y < lit.height && !progress.cancelled(); ++y)
        for (int x = 0; x < lit.width; ++x) *lit.at(x, y) = 3 * litBy(level.rgb(x, y), l);
      return lit;
    };
    Image mean = light(map);
    for (std::size_t mip = 1; mip < levels.size(); ++mip) {
      mean = halve(mean, MipFilter::Box, true, progress);
      const Image lit = light(levels[mip]);
      for (std::size_t i = 0; i < lit.pixels.size(); ++i) {
        const double d = static_cast<double>(lit.pixels[i] - mean.pixels[i]);
        rows[mip - 1].lightRmse += d * d;
      }
    }
  }
  for (MipRow& row : rows)
    row.lightRmse =
        std::sqrt(row.lightRmse / (texels(static_cast<std::size_t>(row.mip)) * static_cast<double>(directions.size())));
  return rows;
}

Expected<void> writeStudy(const Image& map, const std::string& title, const std::filesystem::path& folder,
                          Progress& progress) {
  const std::string text = table(studyFormats(map, 3, progress), studyMips(map, 6, progress), title);
  const Image picture = studyPicture(map, progress);
  if (progress.cancelled()) return interrupted();
  auto files = FileSet::forFolder(folder);
  if (!files) return files.error();
  const auto pictureFile = files->add(folder / "study.png");
  if (!pictureFile) return pictureFile.error();
  const WriteImageOptions options{.format = PixelFormat::U8, .channelNames = {}, .metadata = {}};
  if (auto done = writeImage(*pictureFile, picture, options, progress); !done) return done;
  const auto textFile = files->add(folder / "study.md");
  if (!textFile) return textFile.error();
  if (auto done = writeBytes(*textFile, text); !done) return done;
  return files->commitFolder({});
}

}  // namespace lumel::ssbump

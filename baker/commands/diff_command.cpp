// lumel diff: how far two images or two bakes are apart.
#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>
#include <memory>
#include <ostream>

#include "baker/commands/command.h"
#include "baker/commands/image_figures.h"
#include "baker/files/names/bake_format.h"
#include "baker/files/names/file_names.h"
#include "baker/files/read/baked_scene.h"
#include "scene/files/file_set.h"
#include "scene/images/image_io.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct DiffArguments {
  fs::path a;
  fs::path b;
  fs::path heat;
  fs::path mask;
  bool json = false;
};

Json toJson(const DifferenceFigures& f) {
  return {{"rmse", f.rmse},    {"relativeRmse", f.relativeRmse},
          {"max", f.maximum},  {"meanRatio", f.meanRatio()},
          {"meanA", f.meanA},  {"meanB", f.meanB},
          {"values", f.count}, {"notFinite", f.skipped}};
}

/// Two images of one size, and the figures for them.
struct Pair {
  std::string name;
  LoadedImage a;
  LoadedImage b;
  ImageDifference difference;
};

Expected<Pair> compareFiles(const std::string& name, const fs::path& a, const fs::path& b, const PixelMask& mask) {
  auto first = readImage(a);
  if (!first) return first.error();
  auto second = readImage(b);
  if (!second) return second.error();
  const Image& x = first->image;
  const Image& y = second->image;
  const auto size = [](const Image& i) {
    return std::to_string(i.width) + "x" + std::to_string(i.height) + " with " + std::to_string(i.channels) +
           " channels";
  };
  if (x.width != y.width || x.height != y.height || x.channels != y.channels)
    return inputError(a.string() + " is " + size(x) + ", " + b.string() + " is " + size(y) +
                      "; only images of one size can be compared");
  Pair pair{name, {}, {}, compareImages(x, y, mask)};
  pair.a = std::move(*first);
  pair.b = std::move(*second);
  return pair;
}

/// True where the aux image's coverage (its first channel where none has that name) is above 0.
Expected<PixelMask> readMask(const fs::path& file) {
  auto loaded = readImage(file);
  if (!loaded) return loaded.error();
  const auto& names = loaded->channelNames;
  const auto found = std::find(names.begin(), names.end(), "coverage");
  const auto channel = found == names.end() ? 0 : found - names.begin();
  auto image = std::make_shared<Image>(std::move(loaded->image));
  return PixelMask([image, channel](int x, int y) {
    return x < image->width && y < image->height && image->at(x, y)[channel] > 0.0f;
  });
}

void print(std::ostream& out, const Pair& pair) {
  const auto line = [&](const std::string& label, const DifferenceFigures& f) {
    char text[256];
    std::snprintf(text, sizeof text, "  %-10s rmse %-11.5g relative %-11.5g max %-11.5g mean ratio %.6g", label.c_str(),
                  f.rmse, f.relativeRmse, f.maximum, f.meanRatio());
    out << text;
    if (f.skipped > 0) out << "  (" << f.skipped << " values not finite)";
    out << '\n';
  };
  out << pair.name << '\n';
  line("all", pair.difference.all);
  for (std::size_t c = 0; c < pair.difference.channels.size(); ++c)
    line(c < pair.a.channelNames.size() ? pair.a.channelNames[c] : std::to_string(c), pair.difference.channels[c]);
}

Json toJson(const Pair& pair) {
  Json channels = Json::object();
  for (std::size_t c = 0; c < pair.difference.channels.size(); ++c)
    channels[c < pair.a.channelNames.size() ? pair.a.channelNames[c] : std::to_string(c)] =
        toJson(pair.difference.channels[c]);
  return {{"name", pair.name}, {"all", toJson(pair.difference.all)}, {"channels", std::move(channels)}};
}

Expected<void> writeHeat(const fs::path& file, const Pair& pair, const PixelMask& mask) {
  // White stands for the largest error, so that a single outlier cannot hide: the figure is in the metadata.
  const double full = pair.difference.all.maximum;
  WriteImageOptions options;
  options.format = PixelFormat::U8;
  options.metadata = {{"lumel:heat", "white = " + std::to_string(full)}};
  return writeImage(file, heatMap(pair.a.image, pair.b.image, mask, full), options);
}

Expected<void> report(const DiffArguments& a, CommandContext& context, const std::vector<Pair>& pairs) {
  if (!a.json) {
    for (const Pair& pair : pairs) print(context.out, pair);
    return {};
  }
  Json json = Json::array();
  for (const Pair& pair : pairs) json.push_back(toJson(pair));
  context.out << json.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
  return {};
}

Expected<void> diffImages(const DiffArguments& a, CommandContext& context) {
  if (auto apart = checkNoInput(a.heat, std::array{a.a, a.b, a.mask}); !apart) return apart;
  PixelMask mask = [](int, int) { return true; };
  if (!a.mask.empty()) {
    auto read = readMask(a.mask);
    if (!read) return read.error();
    mask = std::move(*read);
  }
  auto pair = compareFiles(a.a.string() + " against " + a.b.string(), a.a, a.b, mask);
  if (!pair) return pair.error();
  if (!a.heat.empty())
    if (auto written = writeHeat(a.heat, *pair, mask); !written) return written;
  return report(a, context, {std::move(*pair)});
}

/// What tells a chart and its place from others, for all charts of a bake, sorted: the key of a generated one, the
/// object and number of triangles of one that came with the scene.
std::vector<std::string> placesOf(const Json& bake) {
  std::vector<std::string> places;
  const auto charts = bake.find("charts");
  if (charts == bake.end() || !charts->is_object() || !charts->contains("rows")) return places;
  for (const Json& row : charts->at("rows")) {
    if (!row.is_array() || row.size() != chartColumns().size()) continue;
    const auto of = [&row](const char* name) -> const Json& { return chartColumn(row, name); };
    const Json place = of("key").is_null() ? Json::array({of("page"), of("instance"), of("primitive"), of("triangles")})
                                           : Json::array({of("page"), of("key"), of("quarterTurns"), of("x"), of("y")});
    places.push_back(place.dump());
  }
  std::sort(places.begin(), places.end());
  return places;
}

/// Texels of two bakes stand for the same surfaces where their charts lie in the same places. Errors: Input, where none
/// does.
Expected<void> checkCharts(const DiffArguments& a, const Json& first, const Json& second, bool quiet) {
  const std::vector<std::string> placesA = placesOf(first), placesB = placesOf(second);
  std::vector<std::string> both;
  std::set_intersection(placesA.begin(), placesA.end(), placesB.begin(), placesB.end(), std::back_inserter(both));
  const std::size_t most = std::max(placesA.size(), placesB.size());
  if (both.size() == most) return {};
  if (both.empty())
    return inputError(a.a.string() + " and " + a.b.string() +
                      " have no chart in the same place: their texels stand for different surfaces and cannot be "
                      "compared; bake one with --layout-from the other");
  if (!quiet)
    std::fprintf(stderr,
                 "lumel: warning: only %zu of %zu charts lie in the same place in both; texels of others may stand for "
                 "different surfaces\n",
                 both.size(), most);
  return {};
}

/// The images that both bakes have: the maps of the encodings of both and the flat one.
Expected<std::vector<std::string>> commonKinds(const DiffArguments& a, const Json& first, const Json& second,
                                               bool quiet) {
  const std::vector<std::string> ours = encodingNames(first), theirs = encodingNames(second);
  std::vector<std::string> maps;
  bool isAnyCommon = false;
  for (const std::string& name : ours) {
    if (std::find(theirs.begin(), theirs.end(), name) == theirs.end()) continue;
    isAnyCommon = true;
    const auto encoding = encodingOf(first, (a.a / "bake.json").string(), name);
    if (!encoding) return encoding.error();
    for (const std::string& map : (*encoding)->mapNames())
      if (std::find(maps.begin(), maps.end(), map) == maps.end()) maps.push_back(map);
  }
  if (!isAnyCommon && !quiet)
    std::fprintf(stderr, "lumel: warning: %s is encoded as %s, %s as %s: only their flat maps are compared\n",
                 a.a.c_str(), ours.front().c_str(), a.b.c_str(), theirs.front().c_str());
  return lightKinds(maps);
}

Expected<void> diffBakes(const DiffArguments& a, CommandContext& context) {
  const auto first = readBakeJson(a.a);
  if (!first) return first.error();
  const auto second = readBakeJson(a.b);
  if (!second) return second.error();
  const std::size_t pages = first->value("pages", Json::array()).size();
  if (second->value("pages", Json::array()).size() != pages)
    return inputError(a.a.string() + " has " + std::to_string(pages) + " pages, " + a.b.string() + " has " +
                      std::to_string(second->value("pages", Json::array()).size()) + "; they are different atlases");
  if (auto comparable = checkCharts(a, *first, *second, context.quiet); !comparable) return comparable;
  const auto kinds = commonKinds(a, *first, *second, context.quiet);
  if (!kinds) return kinds.error();
  std::vector<Pair> pairs;
  for (std::size_t page = 0; page < pages; ++page) {
    const auto maskA = readMask(a.a / pageFileName(page, "aux"));
    if (!maskA) return maskA.error();
    const auto maskB = readMask(a.b / pageFileName(page, "aux"));
    if (!maskB) return maskB.error();
    const PixelMask both = [&](int x, int y) { return (*maskA)(x, y) && (*maskB)(x, y); };
    for (const std::string& kind : *kinds) {
      const std::string file = pageFileName(page, kind);
      auto pair = compareFiles(file, a.a / file, a.b / file, both);
      if (!pair) return pair.error();
      if (!a.heat.empty()) {
        std::error_code ec;
        fs::create_directories(a.heat, ec);
        const fs::path heat = a.heat / (fs::path(file).stem().string() + "-heat.png");
        if (auto written = writeHeat(heat, *pair, both); !written) return written;
      }
      pair->a.image = Image();  // only the figures are kept
      pair->b.image = Image();
      pairs.push_back(std::move(*pair));
    }
  }
  return report(a, context, pairs);
}

Expected<void> runDiff(const DiffArguments& a, CommandContext& context) {
  std::error_code ec;
  const bool firstIsFolder = fs::is_directory(a.a, ec);
  if (firstIsFolder != fs::is_directory(a.b, ec))
    return usageError("diff compares two images or two bake folders, not one of each");
  if (!firstIsFolder) return diffImages(a, context);
  if (!a.mask.empty()) return usageError("--mask: two bakes are compared where both are covered; leave it out");
  return diffBakes(a, context);
}

}  // namespace

Command diffCommand() {
  Command command;
  const auto arguments = std::make_shared<DiffArguments>();
  DiffArguments& a = *arguments;
  command.name = "diff";
  command.summary = "Error figures and a heat map between two images or two bakes";
  command.examples =
      "rmse: root mean square of A - B; relative: rmse over the root mean square of B (the reference); mean ratio:\n"
      "mean of A over mean of B. Values are compared as stored, without colour conversion.\n"
      "\n"
      "Examples:\n"
      "  lumel diff out/a out/b -o out/heat\n"
      "      all maps of all pages where both bakes are covered, a heat map for each; charts must lie in the same\n"
      "      places: bakes of one scene and layout, whatever its light, materials and samples (--layout-from)\n"
      "  lumel diff a.exr b.exr -o heat.png --mask out/a/lightmap-0-aux.exr";
  command.options.positionalPath("a", a.a, "Image, or folder of a bake").placeholder = "A";
  command.options.positionalPath("b", a.b, "The reference: an image, or folder of a bake").placeholder = "B";
  Option& heat = command.options.path("output", a.heat, "Heat map to write; for two bakes a folder of them");
  heat.shortName = "o";
  command.options.path("mask", a.mask, "Compare only where this aux image's coverage is above 0");
  command.options.flag("json", a.json, "Print JSON");
  command.run = [arguments](CommandContext& context) { return runDiff(*arguments, context); };
  return command;
}

}  // namespace lumel

// lumel convert: another encoding from the maps of a bake, without rays.
#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>

#include "baker/commands/command.h"
#include "baker/files/names/bake_format.h"
#include "baker/files/names/conventions.h"
#include "baker/files/names/file_names.h"
#include "baker/files/read/baked_scene.h"
#include "lightmap/maps/rnm_to_sh.h"
#include "scene/base/parallel.h"
#include "scene/files/file_set.h"
#include "scene/images/image_io.h"

namespace lumel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// What can be made.
enum class Target { Sh1 };

struct ConvertArguments {
  fs::path bake;
  Target to = Target::Sh1;
};

/// A page's three maps and the flat one.
struct PageMaps {
  std::array<Image, 3> rnm;
  LoadedImage flat;
};

Expected<PageMaps> readPage(const fs::path& dir, std::size_t page, const Encoding& rnm) {
  PageMaps maps;
  auto flat = readImage(dir / pageFileName(page, kFlatMap));
  if (!flat) return flat.error();
  maps.flat = std::move(*flat);
  for (std::size_t k = 0; k < maps.rnm.size(); ++k) {
    const fs::path file = dir / pageFileName(page, rnm.mapNames()[k]);
    auto map = readImage(file);
    if (!map) return map.error();
    const Image& own = map->image;
    if (own.channels != 3 || own.width != maps.flat.image.width || own.height != maps.flat.image.height)
      return inputError(file.string() + ": its size or channels differ from the flat map's; bake again");
    maps.rnm[k] = std::move(map->image);
  }
  return maps;
}

std::array<Image, 4> convertPage(const PageMaps& maps) {
  const int width = maps.flat.image.width, height = maps.flat.image.height;
  std::array<Image, 4> converted;
  converted.fill(Image(width, height, 3));
  parallelFor(static_cast<std::size_t>(height), 16, [&](std::size_t first, std::size_t last) {
    for (int y = static_cast<int>(first); y < static_cast<int>(last); ++y)
      for (int x = 0; x < width; ++x) {
        const std::array<Vec3, 4> sh1 = sh1FromRawRnm(
            {maps.rnm[0].rgb(x, y), maps.rnm[1].rgb(x, y), maps.rnm[2].rgb(x, y)}, maps.flat.image.rgb(x, y));
        for (std::size_t k = 0; k < sh1.size(); ++k) converted[k].setRgb(x, y, sh1[k]);
      }
  });
  return converted;
}

/// What the flat map's file says of the bake, with the conventions of the new maps.
WriteImageOptions optionsFor(const LoadedImage& flat, const Encoding& encoding, const std::string& map) {
  WriteImageOptions options;
  const bool isHalf = flat.bitsPerChannel == 16;
  options.format = isHalf ? PixelFormat::Half : PixelFormat::Float;
  options.noisy = !isHalf;
  for (const auto& [key, text] : flat.metadata)
    if (key.starts_with("lumel:")) options.metadata[key] = text;
  for (const auto& [key, text] : describeConventions(encoding)) options.metadata["lumel:" + key] = text;
  options.metadata["lumel:encoding"] = encoding.name();
  options.metadata["lumel:map"] = map;
  std::string names;
  for (const std::string& name : encoding.mapNames()) names += (names.empty() ? "" : " ") + name;
  options.metadata["lumel:maps"] = names;
  options.metadata["lumel:convertedFrom"] = "rnm";
  return options;
}

/// Enters the encoding into bake.json.
void enter(Json& bake, const Encoding& encoding) {
  if (!bake.contains("encodings")) {
    Json first = bake.value("encoding", Json{{"name", "rnm"}});
    first["conventions"] = bake.at("conventions");
    bake["encodings"] = Json::array({std::move(first)});
  }
  Json row = describeEncoding(encoding);
  row["conventions"] = encoding.conventions();
  row["convertedFrom"] = "rnm";
  bake["encodings"].push_back(std::move(row));
  for (std::size_t page = 0; page < bake.at("pages").size(); ++page)
    for (const std::string& name : encoding.mapNames())
      bake["pages"][page]["files"][encoding.name()].push_back(pageFileName(page, name));
}

/// The encoding that is made from, where the bake has it as it is needed.
Expected<std::shared_ptr<const Encoding>> rawRnmOf(const Json& bake, const fs::path& dir, const Encoding& wanted) {
  const std::string file = (dir / "bake.json").string();
  const std::vector<std::string> names = encodingNames(bake);
  if (std::ranges::find(names, wanted.name()) != names.end())
    return inputError(file + ": the bake holds " + wanted.name() + " already");
  auto rnm = encodingOf(bake, file, "rnm");
  if (!rnm) return rnm;
  const std::string& projection = (*rnm)->conventions().at("projection");
  if (projection != nameOf(Projection::Raw))
    return inputError(file + ": its rnm maps are of projection " + projection +
                      ", and the conversion needs raw ones; bake with --projection raw, or with --encoding rnm,sh1");
  const Json pages = bake.value("pages", Json());
  const auto hasFiles = [](const Json& page) { return page.is_object() && page.value("files", Json()).is_object(); };
  if (!pages.is_array() || !std::all_of(pages.begin(), pages.end(), hasFiles))
    return inputError(file + ": /pages is not a list of pages with files; bake again");
  return rnm;
}

Expected<void> runConvert(const ConvertArguments& a, CommandContext& context) {
  FileSet::recover(a.bake);
  auto bake = readBakeJson(a.bake);
  if (!bake) return bake.error();
  const std::shared_ptr<const Encoding> encoding = sh1Encoding();
  const auto rnm = rawRnmOf(*bake, a.bake, *encoding);
  if (!rnm) return rnm.error();
  FileSet set;
  for (std::size_t page = 0; page < bake->at("pages").size(); ++page) {
    const auto maps = readPage(a.bake, page, **rnm);
    if (!maps) return maps.error();
    const std::array<Image, 4> converted = convertPage(*maps);
    for (std::size_t k = 0; k < converted.size(); ++k) {
      const std::string& name = encoding->mapNames()[k];
      const auto file = set.add(a.bake / pageFileName(page, name));
      if (!file) return file.error();
      if (auto done = writeImage(*file, converted[k], optionsFor(maps->flat, *encoding, name)); !done) return done;
    }
    if (context.progress.cancelled()) return interrupted();
  }
  enter(*bake, *encoding);
  const auto file = set.add(a.bake / "bake.json");
  if (!file) return file.error();
  if (auto done = writeBytes(*file, bakeJsonText(*bake)); !done) return done;
  if (auto done = set.commit(); !done) return done;
  if (!context.quiet)
    std::fprintf(stderr, "%s: %s added to %zu page%s\n", a.bake.c_str(), encoding->name().c_str(),
                 bake->at("pages").size(), bake->at("pages").size() == 1 ? "" : "s");
  return {};
}

}  // namespace

Command convertCommand() {
  Command command;
  const auto arguments = std::make_shared<ConvertArguments>();
  command.name = "convert";
  command.summary = "Add maps of another encoding to a bake, from those that it has";
  command.examples =
      "From the rnm maps of a bake with --projection raw and its flat map, without rays: what agrees with the four\n"
      "irradiances that these know. For readers that decode L0 + N.L it is as good as what --encoding sh1 samples, or\n"
      "better (lightmap/maps/encodings.md has figures); for readers that take L0 and L for radiance it is not.\n"
      "\n"
      "Examples:\n"
      "  lumel convert out/level --to sh1\n"
      "  lumel render out/level --encoding sh1 -o still.png";
  command.options.positionalPath("bake", arguments->bake, "Folder that lumel bake -o wrote; the maps are added to it")
      .placeholder = "DIR";
  command.options.choice("to", arguments->to, {"sh1"}, "The encoding to add");
  command.run = [arguments](CommandContext& context) { return runConvert(*arguments, context); };
  return command;
}

}  // namespace lumel

// Runs the lumel binary as a user would, and makes small scenes for it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "scene/base/math.h"
#include "tests/scratch.h"

namespace lumel::cli {

struct Outcome {
  int exitCode = -1;  // 128 + signal where one ended it
  std::string out;
  std::string err;
  double secondsToStop = 0;  // from the signal, where one was sent, to the end
};

/// What a process starts with.
struct Surroundings {
  std::filesystem::path folder;   // empty: the test's own
  std::size_t fileSizeLimit = 0;  // bytes at which a write to any file fails, as on a full disk; 0: none
};

/// Runs `lumel ARGUMENTS...` with both outputs in pipes.
Outcome run(const std::vector<std::string>& arguments, const Surroundings& surroundings = {});

/// The same with all output on a terminal; `out` holds what the terminal got. Nothing where the system has none to
/// give.
std::optional<Outcome> runOnTerminal(const std::vector<std::string>& arguments, const Surroundings& surroundings = {});

/// Starts it, sends SIGINT once its standard error holds `sign`, and waits for the end.
Outcome runAndInterrupt(const std::vector<std::string>& arguments, const std::string& sign);

/// The same, once it has used so much CPU time: a loaded machine delays the signal as it delays the work.
Outcome runAndInterrupt(const std::vector<std::string>& arguments, double cpuSeconds, int signal,
                        const Surroundings& surroundings = {});

std::string readFile(const std::filesystem::path& file);
void writeFile(const std::filesystem::path& file, const std::string& content);
nlohmann::json readJson(const std::filesystem::path& file);

/// Name and content of every file in a folder, hidden ones too.
std::map<std::string, std::string> readFolder(const std::filesystem::path& dir);

/// A quad for a glTF file: corners counter-clockwise, TEXCOORD_1 (and 0) spanning a rectangle of the page, the first
/// corner at its top left, the second below it.
struct Quad {
  Vec3 corners[4];
  Vec2 uvLeast{0, 0};
  Vec2 uvMost{1, 1};
};

/// A glTF document of one node with one material, to be changed by the test before it is written.
nlohmann::json gltfOf(const std::vector<Quad>& quads);

/// A closed box of 2 m seen from inside, each side in its own sixth of the page.
std::vector<Quad> boxFromInside();

/// A floor of 2 m around the origin, face up, over the whole page.
Quad floorQuad();

/// Adds a camera 3 m above the origin that looks straight down at `halfExtent` metres to each side.
void addCameraAbove(nlohmann::json& gltf, float halfExtent);

}  // namespace lumel::cli

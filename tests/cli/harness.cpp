#include "tests/cli/harness.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstring>
#include <ctime>
#include <fstream>
#include <functional>

namespace lumel::cli {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

[[noreturn]] void becomeLumel(const std::vector<std::string>& arguments, const Surroundings& surroundings) {
  if (!surroundings.folder.empty() && chdir(surroundings.folder.c_str()) != 0) _exit(126);
  if (surroundings.fileSizeLimit > 0) {
    const rlimit limit{surroundings.fileSizeLimit, surroundings.fileSizeLimit};
    signal(SIGXFSZ, SIG_IGN);  // or it would end the program
    if (setrlimit(RLIMIT_FSIZE, &limit) != 0) _exit(126);
  }
  std::vector<char*> argv{const_cast<char*>(LUMEL_BINARY)};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  execv(LUMEL_BINARY, argv.data());
  _exit(126);
}

int waitFor(pid_t child) {
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/// False at the end of the stream.
bool readSome(int descriptor, std::string& into) {
  std::array<char, 4096> buffer{};
  const ssize_t got = read(descriptor, buffer.data(), buffer.size());
  if (got <= 0) return false;
  into.append(buffer.data(), static_cast<std::size_t>(got));
  return true;
}

/// CPU time that a process has used so far, all threads.
double cpuSecondsOf(pid_t process) {
  clockid_t clock;
  timespec used{};
  if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &used) != 0) return 0;
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

/// When to send a signal to a running process; never, where `signal` is 0.
struct Interruption {
  int signal = 0;
  std::function<bool(pid_t process, const Outcome& soFar)> isDue;
};

Outcome runWatching(const std::vector<std::string>& arguments, const Interruption& interruption,
                    const Surroundings& surroundings) {
  int out[2];
  int err[2];
  if (pipe(out) != 0 || pipe(err) != 0) return {};
  const pid_t child = fork();
  if (child == 0) {
    dup2(out[1], STDOUT_FILENO);
    dup2(err[1], STDERR_FILENO);
    for (int descriptor : {out[0], out[1], err[0], err[1]}) close(descriptor);
    becomeLumel(arguments, surroundings);
  }
  close(out[1]);
  close(err[1]);
  Outcome outcome;
  bool outOpen = true;
  bool errOpen = true;
  std::optional<Clock::time_point> sent;
  while (outOpen || errOpen) {
    std::array<pollfd, 2> watched = {pollfd{outOpen ? out[0] : -1, POLLIN, 0},
                                     pollfd{errOpen ? err[0] : -1, POLLIN, 0}};
    const bool waiting = interruption.signal != 0 && !sent;
    poll(watched.data(), watched.size(), waiting ? 10 : -1);
    if (watched[0].revents != 0) outOpen = readSome(out[0], outcome.out);
    if (watched[1].revents != 0) errOpen = readSome(err[0], outcome.err);
    if (waiting && interruption.isDue(child, outcome)) {
      kill(child, interruption.signal);
      sent = Clock::now();
    }
  }
  close(out[0]);
  close(err[0]);
  outcome.exitCode = waitFor(child);
  if (sent) outcome.secondsToStop = std::chrono::duration<double>(Clock::now() - *sent).count();
  return outcome;
}

std::string base64(const std::vector<std::uint8_t>& bytes) {
  static const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto at = [&](std::size_t k) { return k < bytes.size() ? static_cast<unsigned>(bytes[k]) : 0u; };
    const unsigned triple = at(i) << 16 | at(i + 1) << 8 | at(i + 2);
    for (int shift = 18; shift >= 0; shift -= 6) text += kDigits[triple >> shift & 63u];
    if (i + 1 >= bytes.size()) text[text.size() - 2] = '=';
    if (i + 2 >= bytes.size()) text[text.size() - 1] = '=';
  }
  return text;
}

}  // namespace

Outcome run(const std::vector<std::string>& arguments, const Surroundings& surroundings) {
  return runWatching(arguments, {}, surroundings);
}

Outcome runAndInterrupt(const std::vector<std::string>& arguments, const std::string& sign) {
  const auto seen = [&](pid_t, const Outcome& soFar) { return soFar.err.find(sign) != std::string::npos; };
  return runWatching(arguments, {SIGINT, seen}, {});
}

Outcome runAndInterrupt(const std::vector<std::string>& arguments, double cpuSeconds, int signal,
                        const Surroundings& surroundings) {
  const auto worked = [&](pid_t process, const Outcome&) { return cpuSecondsOf(process) >= cpuSeconds; };
  return runWatching(arguments, {signal, worked}, surroundings);
}

std::optional<Outcome> runOnTerminal(const std::vector<std::string>& arguments, const Surroundings& surroundings) {
  int terminal = -1;
  const pid_t child = forkpty(&terminal, nullptr, nullptr, nullptr);
  if (child < 0) return std::nullopt;
  if (child == 0) becomeLumel(arguments, surroundings);
  Outcome outcome;
  while (readSome(terminal, outcome.out)) {
  }
  close(terminal);
  outcome.exitCode = waitFor(child);
  return outcome;
}

std::string readFile(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  EXPECT_TRUE(in.is_open()) << file;
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void writeFile(const fs::path& file, const std::string& content) { std::ofstream(file, std::ios::binary) << content; }

nlohmann::json readJson(const fs::path& file) { return nlohmann::json::parse(readFile(file), nullptr, false); }

std::map<std::string, std::string> readFolder(const fs::path& dir) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(dir))
    files[entry.path().lexically_relative(dir)] = entry.is_regular_file() ? readFile(entry.path()) : "(folder)";
  return files;
}

nlohmann::json gltfOf(const std::vector<Quad>& quads) {
  std::vector<float> positions;
  std::vector<float> uvs;
  std::vector<float> indices;
  for (const Quad& quad : quads) {
    const float first = static_cast<float>(positions.size() / 3);
    const Vec2 uv[4] = {quad.uvLeast, {quad.uvLeast.x, quad.uvMost.y}, quad.uvMost, {quad.uvMost.x, quad.uvLeast.y}};
    for (int k = 0; k < 4; ++k) {
      positions.insert(positions.end(), {quad.corners[k].x, quad.corners[k].y, quad.corners[k].z});
      uvs.insert(uvs.end(), {uv[k].x, uv[k].y});
    }
    for (float k : {0.0f, 1.0f, 2.0f, 0.0f, 2.0f, 3.0f}) indices.push_back(first + k);
  }
  std::vector<std::uint8_t> bytes;
  const auto append = [&](const auto& values) {
    const std::size_t at = bytes.size();
    bytes.resize(at + values.size() * sizeof(values[0]));
    std::memcpy(bytes.data() + at, values.data(), values.size() * sizeof(values[0]));
    return nlohmann::json{{"buffer", 0}, {"byteOffset", at}, {"byteLength", bytes.size() - at}};
  };
  const std::vector<std::uint32_t> whole(indices.begin(), indices.end());
  nlohmann::json views = {append(positions), append(uvs), append(whole)};
  std::vector<float> least(3, 1e9f), most(3, -1e9f);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    least[i % 3] = std::min(least[i % 3], positions[i]);
    most[i % 3] = std::max(most[i % 3], positions[i]);
  }
  const std::size_t vertices = positions.size() / 3;
  return {
      {"asset", {{"version", "2.0"}}},
      {"scene", 0},
      {"scenes", {{{"nodes", {0}}}}},
      {"nodes", {{{"name", "Thing"}, {"mesh", 0}}}},
      {"meshes",
       {{{"name", "Thing"},
         {"primitives",
          {{{"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}, {"TEXCOORD_1", 1}}},
            {"indices", 2},
            {"material", 0}}}}}}},
      {"materials", {{{"name", "Paint"}, {"pbrMetallicRoughness", {{"metallicFactor", 0.0}}}}}},
      {"accessors",
       {{{"bufferView", 0},
         {"componentType", 5126},
         {"count", vertices},
         {"type", "VEC3"},
         {"min", least},
         {"max", most}},
        {{"bufferView", 1}, {"componentType", 5126}, {"count", vertices}, {"type", "VEC2"}},
        {{"bufferView", 2}, {"componentType", 5125}, {"count", whole.size()}, {"type", "SCALAR"}}}},
      {"bufferViews", views},
      {"buffers", {{{"byteLength", bytes.size()}, {"uri", "data:application/octet-stream;base64," + base64(bytes)}}}}};
}

std::vector<Quad> boxFromInside() {
  std::vector<Quad> quads;
  // Right-handed (u, v, n) with n pointing inside; the quad lies at -n.
  const Vec3 axes[6][3] = {{{1, 0, 0}, {0, 0, -1}, {0, 1, 0}}, {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}},
                           {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},  {{-1, 0, 0}, {0, 1, 0}, {0, 0, -1}},
                           {{0, 0, -1}, {0, 1, 0}, {1, 0, 0}}, {{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}}};
  for (int i = 0; i < 6; ++i) {
    const auto& [u, v, n] = axes[i];
    const Vec2 cell(static_cast<float>(i % 3) / 3.0f, static_cast<float>(i / 3) / 2.0f);
    quads.push_back(
        {{v - u - n, -u - v - n, u - v - n, u + v - n}, cell + Vec2(0.04f, 0.06f), cell + Vec2(0.29f, 0.44f)});
  }
  return quads;
}

Quad floorQuad() { return {{{-1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1}}}; }

void addCameraAbove(nlohmann::json& gltf, float halfExtent) {
  gltf["cameras"] = {{{"name", "Above"},
                      {"type", "orthographic"},
                      {"orthographic", {{"xmag", halfExtent}, {"ymag", halfExtent}, {"znear", 0.1}, {"zfar", 10.0}}}}};
  // Its -z is the world's -y, its y the world's -z.
  gltf["nodes"].push_back(
      {{"name", "Above"}, {"camera", 0}, {"matrix", {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 3, 0, 1}}});
  gltf["scenes"][0]["nodes"].push_back(gltf["nodes"].size() - 1);
}

}  // namespace lumel::cli

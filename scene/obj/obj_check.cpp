#include "scene/obj/obj_check.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "scene/scene.h"

namespace lumel {
namespace {

constexpr std::size_t kMaxCorners = 255;

/// Vertices, texture coordinates and normals so far, or in all.
using Counts = std::array<std::int64_t, 3>;
constexpr std::array<const char*, 3> kKinds = {"vertex", "texture coordinate", "normal"};

bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

std::string_view nextToken(std::string_view& line) {
  std::size_t begin = 0;
  while (begin < line.size() && isBlank(line[begin])) ++begin;
  std::size_t end = begin;
  while (end < line.size() && !isBlank(line[end])) ++end;
  const std::string_view token = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return token;
}

template <class Body>
void forEachLine(std::string_view text, const Body& body) {
  std::size_t number = 1;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of("\n"), text.size());
    if (!body(text.substr(0, end), number++)) return;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

/// 0, 1, 2 for "v", "vt", "vn"; -1 for other statements.
int kindOf(std::string_view keyword) { return keyword == "v" ? 0 : keyword == "vt" ? 1 : keyword == "vn" ? 2 : -1; }

std::optional<std::string> checkNumbers(std::string_view line, int kind) {
  const int needed = kind == 1 ? 1 : 3;
  for (int i = 0; i < needed; ++i) {
    std::string_view token = nextToken(line);
    if (token.empty()) return std::string("a ") + kKinds[static_cast<std::size_t>(kind)] + " with too few numbers";
    if (token.front() == '+') token.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), value);
    if (error != std::errc() || end != token.data() + token.size() || !std::isfinite(value) ||
        std::abs(value) > double{kMaxCoordinate})
      return std::string("a ") + kKinds[static_cast<std::size_t>(kind)] + " with '" + std::string(token.substr(0, 40)) +
             "', which is not a finite number below 1e18";
  }
  return std::nullopt;
}

/// One corner "v", "v/vt", "v//vn" or "v/vt/vn"; negative indices count back from the last element so far.
std::optional<std::string> checkCorner(std::string_view token, const Counts& soFar, const Counts& total) {
  for (std::size_t kind = 0; kind < 3 && !token.empty(); ++kind) {
    const std::size_t end = std::min(token.find('/'), token.size());
    const std::string_view part = token.substr(0, end);
    token.remove_prefix(std::min(end + 1, token.size()));
    if (part.empty() && kind != 0) continue;
    std::int64_t index = 0;
    const auto [stop, error] = std::from_chars(part.data(), part.data() + part.size(), index);
    if (error != std::errc() || stop != part.data() + part.size())
      return "a face with '" + std::string(part.substr(0, 40)) + "', which is not an index";
    if (kind == 2 && index > 0 && total[kind] == 0) continue;  // "v//vn" without normals: see parseObj
    if (index == 0 || index > total[kind] || index < -soFar[kind])
      return std::string("a face refers to ") + kKinds[kind] + " " + std::to_string(index) + ", but there are " +
             std::to_string(index < 0 ? soFar[kind] : total[kind]);
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> checkObjText(std::string_view text) {
  std::optional<std::string> problem;
  const auto fail = [&](std::size_t number, const std::string& what) {
    problem = "line " + std::to_string(number) + ": " + what;
    return false;
  };
  Counts total{};
  forEachLine(text, [&](std::string_view line, std::size_t number) {
    const int kind = kindOf(nextToken(line));
    if (kind < 0) return true;
    ++total[static_cast<std::size_t>(kind)];
    const auto wrong = checkNumbers(line, kind);
    return wrong ? fail(number, *wrong) : true;
  });
  if (problem) return problem;
  Counts soFar{};
  forEachLine(text, [&](std::string_view line, std::size_t number) {
    const std::string_view keyword = nextToken(line);
    if (const int kind = kindOf(keyword); kind >= 0) ++soFar[static_cast<std::size_t>(kind)];
    if (keyword != "f" && keyword != "l" && keyword != "p") return true;
    std::size_t corners = 0;
    for (std::string_view token = nextToken(line); !token.empty(); token = nextToken(line), ++corners)
      if (const auto wrong = checkCorner(token, soFar, total)) return fail(number, *wrong);
    if (keyword == "f" && corners > kMaxCorners)
      return fail(number, "a polygon with " + std::to_string(corners) + " corners; split those with more than 255");
    return true;
  });
  return problem;
}

}  // namespace lumel

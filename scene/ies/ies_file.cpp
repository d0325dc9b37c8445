#include "scene/ies/ies_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <vector>

namespace lumel {
namespace {

constexpr int kMostAngles = 4096;

/// Reads numbers one by one, and says where it stands.
class IesReader {
 public:
  explicit IesReader(std::string_view text) : rest_(text) {}

  /// The next line without its end; nothing at the end of the text.
  std::optional<std::string_view> line() {
    if (rest_.empty()) return std::nullopt;
    ++line_;
    const std::size_t end = rest_.find_first_of("\r\n");
    const std::string_view found = rest_.substr(0, end);
    const bool two = end != std::string_view::npos && rest_.substr(end, 2) == "\r\n";
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + (two ? 2 : 1));
    return found;
  }

  Error error(const std::string& problem) const { return inputError("line " + std::to_string(line_) + ": " + problem); }

  /// The next number, which `what` names. Whitespace and commas part numbers.
  Expected<double> number(const std::string& what) {
    skipGaps();
    if (rest_.empty()) return error("the file ends before " + what + "; get the whole file");
    const std::size_t length = std::min(rest_.find_first_of(" \t\r\n,"), rest_.size());
    std::string_view token = rest_.substr(0, length);
    if (token.front() == '+') token.remove_prefix(1);
    double value = 0.0;
    const auto [end, problem] = std::from_chars(token.data(), token.data() + token.size(), value);
    if (problem != std::errc() || end != token.data() + token.size() || !std::isfinite(value))
      return error("'" + std::string(rest_.substr(0, std::min<std::size_t>(length, 32))) + "' stands for " + what +
                   " and is not a number");
    rest_.remove_prefix(length);
    return value;
  }

  /// A whole number in [least, most].
  Expected<int> count(const std::string& what, int least, int most) {
    const auto value = number(what);
    if (!value) return value.error();
    if (*value != std::floor(*value) || *value < least || *value > most)
      return error(what + " must be a whole number from " + std::to_string(least) + " to " + std::to_string(most));
    return static_cast<int>(*value);
  }

  bool atEnd() {
    skipGaps();
    return rest_.empty();
  }

 private:
  void skipGaps() {
    while (!rest_.empty() && std::string_view(" \t\r\n,").find(rest_.front()) != std::string_view::npos) {
      if (rest_.front() == '\n') ++line_;
      rest_.remove_prefix(1);
    }
  }

  std::string_view rest_;
  int line_ = 0;
};

/// Goes on behind the line TILT=, and behind the tilt that may follow, which says how light changes as the lamp is
/// turned: it plays no part here.
std::optional<Error> skipHead(IesReader& reader) {
  bool isFirst = true;
  for (;;) {
    const auto line = reader.line();
    if (!line) return reader.error("there is no line TILT=; is this an IES file (LM-63)?");
    if (isFirst && line->rfind("IES", 0) != 0 && line->find("TILT=") == std::string_view::npos &&
        line->find('\0') != std::string_view::npos)
      return reader.error("this is no text; is this an IES file (LM-63)?");
    isFirst = false;
    if (line->rfind("TILT=", 0) != 0) continue;
    std::string_view tilt = line->substr(5);
    while (!tilt.empty() && (tilt.back() == ' ' || tilt.back() == '\t')) tilt.remove_suffix(1);
    if (tilt == "NONE") return std::nullopt;
    if (tilt != "INCLUDE") return reader.error("TILT= names another file; use TILT=NONE");
    if (const auto geometry = reader.count("the lamp's geometry", 1, 3); !geometry) return geometry.error();
    const auto pairs = reader.count("the number of tilt angles", 0, kMostAngles);
    if (!pairs) return pairs.error();
    for (int i = 0; i < 2 * *pairs; ++i)
      if (const auto value = reader.number("a tilt"); !value) return value.error();
    return std::nullopt;
  }
}

struct IesHead {
  int verticals = 0, horizontals = 0;
  double multiplier = 1.0;
};

Expected<IesHead> readHead(IesReader& reader) {
  IesHead head;
  if (const auto lamps = reader.number("the number of lamps"); !lamps) return lamps.error();
  if (const auto lumens = reader.number("the lumens of a lamp"); !lumens) return lumens.error();
  const auto multiplier = reader.number("the multiplier");
  if (!multiplier) return multiplier.error();
  const auto verticals = reader.count("the number of vertical angles", 2, kMostAngles);
  if (!verticals) return verticals.error();
  const auto horizontals = reader.count("the number of horizontal angles", 1, kMostAngles);
  if (!horizontals) return horizontals.error();
  const auto type = reader.count("the photometric type", 1, 3);
  if (!type) return type.error();
  if (*type != 1)
    return reader.error(std::string("the photometric type is ") + (*type == 2 ? "B" : "A") +
                        "; only type C is read, convert the file to it");
  if (const auto units = reader.count("the unit of lengths", 1, 2); !units) return units.error();
  for (const char* what : {"the width", "the length", "the height"})
    if (const auto value = reader.number(what); !value) return value.error();
  const auto ballast = reader.number("the ballast factor");
  if (!ballast) return ballast.error();
  const auto future = reader.number("the ballast-lamp factor");
  if (!future) return future.error();
  if (const auto watts = reader.number("the input watts"); !watts) return watts.error();
  head.verticals = *verticals;
  head.horizontals = *horizontals;
  head.multiplier = *multiplier * *ballast * *future;
  if (!(head.multiplier > 0.0)) return reader.error("the multiplier and the ballast factors must be above 0");
  return head;
}

Expected<std::vector<float>> readAngles(IesReader& reader, int count, const std::string& what, double most) {
  std::vector<float> angles;
  for (int i = 0; i < count; ++i) {
    const auto angle = reader.number(what);
    if (!angle) return angle.error();
    if (*angle < 0.0 || *angle > most)
      return reader.error(what + " must lie in 0 to " + std::to_string(static_cast<int>(most)) + " degrees");
    if (!angles.empty() && !(static_cast<float>(*angle) > angles.back())) return reader.error(what + "s must ascend");
    angles.push_back(static_cast<float>(*angle));
  }
  return angles;
}

/// Copies what the file has for a part of the circle to the rest of it.
std::optional<std::string> completeCircle(LightProfile& profile) {
  const std::size_t row = profile.verticals.size();
  std::vector<float>& angles = profile.horizontals;
  const auto add = [&](float angle, std::size_t from) {
    angles.push_back(angle);
    const std::vector<float> copied(profile.shares.begin() + static_cast<std::ptrdiff_t>(from * row),
                                    profile.shares.begin() + static_cast<std::ptrdiff_t>((from + 1) * row));
    profile.shares.insert(profile.shares.end(), copied.begin(), copied.end());
  };
  const auto mirrorAbout = [&](float axis) {
    for (std::size_t i = angles.size() - 1; i-- > 0;) add(2.0f * axis - angles[i], i);
  };
  if (angles.size() == 1) return std::nullopt;
  if (angles.front() == 90.0f && angles.back() == 270.0f) {
    // The half about C = 180 is known; what lies at C beyond 270 mirrors it, and comes to lie at 0 to 90 as well.
    mirrorAbout(270.0f);
    std::vector<std::pair<float, std::size_t>> places;
    for (std::size_t i = 0; i < angles.size(); ++i) {
      if (angles[i] <= 360.0f) places.emplace_back(angles[i], i);
      if (angles[i] >= 360.0f) places.emplace_back(angles[i] - 360.0f, i);
    }
    std::ranges::sort(places);
    places.erase(std::ranges::unique(places, {}, &std::pair<float, std::size_t>::first).begin(), places.end());
    LightProfile turned;
    for (const auto& [angle, from] : places) {
      turned.horizontals.push_back(angle);
      turned.shares.insert(turned.shares.end(), profile.shares.begin() + static_cast<std::ptrdiff_t>(from * row),
                           profile.shares.begin() + static_cast<std::ptrdiff_t>((from + 1) * row));
    }
    if (turned.horizontals.front() != 0.0f) return "angles from 90 to 270 need one at 180";
    profile.horizontals = std::move(turned.horizontals);
    profile.shares = std::move(turned.shares);
    return std::nullopt;
  }
  if (angles.front() != 0.0f) return "the first horizontal angle must be 0 (or 90, where the last is 270)";
  if (angles.back() == 90.0f) mirrorAbout(90.0f);
  if (angles.back() == 180.0f) mirrorAbout(180.0f);
  if (angles.back() != 360.0f) return "the last horizontal angle must be 0, 90, 180 or 360";
  return std::nullopt;
}

}  // namespace

Expected<LightProfile> parseIes(std::string_view text) {
  IesReader reader(text);
  if (auto error = skipHead(reader)) return *error;
  const auto head = readHead(reader);
  if (!head) return head.error();
  LightProfile profile;
  auto verticals = readAngles(reader, head->verticals, "a vertical angle", 180.0);
  if (!verticals) return verticals.error();
  auto horizontals = readAngles(reader, head->horizontals, "a horizontal angle", 360.0);
  if (!horizontals) return horizontals.error();
  profile.verticals = *std::move(verticals);
  profile.horizontals = *std::move(horizontals);
  std::vector<double> candela(profile.verticals.size() * profile.horizontals.size());
  for (double& c : candela) {
    const auto value = reader.number("an intensity");
    if (!value) return value.error();
    if (*value < 0.0) return reader.error("an intensity is negative");
    c = *value * head->multiplier;
  }
  if (!reader.atEnd()) return reader.error("there is more than the intensities that the head announces");
  const double most = *std::ranges::max_element(candela);
  if (!(most > 0.0) || !(most < 1e30)) return reader.error("no intensity is above 0");
  profile.mostCandela = static_cast<float>(most);
  for (const double c : candela) profile.shares.push_back(static_cast<float>(c / most));
  if (const auto problem = completeCircle(profile)) return reader.error(*problem);
  profile.text = text;
  return profile;
}

}  // namespace lumel

#include "baker/audit/audit.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "baker/audit/audit_draws.h"
#include "baker/audit/audited_texels.h"

namespace lumel {
namespace {

/// Draws before it is known what a draw costs.
constexpr std::size_t kPilotDraws = 256;
/// Fewer draws judge nothing: the variance of so few is not known well enough.
constexpr std::size_t kLeastDraws = 64;
constexpr double kSigmas = 3.0;
/// How many times as many draws a suspected stratum gets, and at most how many strata.
constexpr std::size_t kSecondLook = 4;
constexpr std::size_t kMostSecondLooks = 8;
/// Strata that hold less than this share of the mean light, by map and by paths, are not judged: so few paths reach
/// sealed corners that their variance is not known.
constexpr double kTooDark = 1e-4;

bool isOff(const AuditStratum& stratum) {
  const double off = std::abs(stratum.ratio - 1.0);
  return stratum.drawn >= kLeastDraws && off > kAuditTolerance && off > kSigmas * stratum.standardError;
}

/// The ratio of means over the draws that `belongs` picks.
template <class Belongs>
AuditStratum judge(std::string name, std::span<const AuditDraw> draws, const AuditPopulation& population,
                   double meanLight, Belongs belongs) {
  AuditStratum stratum;
  stratum.name = std::move(name);
  double map = 0.0, paths = 0.0, weights = 0.0;
  for (const AuditDraw& draw : draws) {
    if (draw.weight == 0.0 || !belongs(draw)) continue;
    ++stratum.drawn;
    weights += draw.weight;
    map += draw.weight * draw.map;
    paths += draw.weight * draw.paths;
  }
  if (stratum.drawn == 0 || std::max(map, paths) < kTooDark * meanLight * weights) return stratum;
  if (paths > 0.0)
    stratum.ratio = map / paths;
  else if (map > 0.0)
    stratum.ratio = std::numeric_limits<double>::infinity();
  double squares = 0.0, most = -1.0;
  for (const AuditDraw& draw : draws) {
    if (!belongs(draw)) continue;
    const double residual = paths > 0.0 ? draw.weight * (draw.map - stratum.ratio * draw.paths) : 0.0;
    squares += residual * residual;
    const double speaks = (stratum.ratio > 1.0 ? 1.0 : -1.0) * draw.weight * (draw.map - draw.paths);
    if (speaks <= most) continue;
    most = speaks;
    stratum.page = population.pageOf(draw.texel);
    stratum.texel = population.coordOf(draw.texel);
    stratum.position = draw.position;
  }
  const auto drawn = static_cast<double>(stratum.drawn);
  if (paths > 0.0 && stratum.drawn > 1) stratum.standardError = std::sqrt(squares * drawn / (drawn - 1.0)) / paths;
  return stratum;
}

std::string decadeName(int from, int to) {
  if (to <= AuditPopulation::kDarkest) return "no light";
  char text[64];
  if (from <= AuditPopulation::kDarkest)
    std::snprintf(text, sizeof text, "light below 1e%d", to + 1);
  else
    std::snprintf(text, sizeof text, "light 1e%d to 1e%d", from, to + 1);
  return text;
}

/// Looks again at what is off, with draws of its own, and keeps what these say.
template <class Belongs>
void lookAgain(AuditStratum& stratum, std::span<const std::uint32_t> texels, AuditTracer& tracer,
               const AuditPopulation& population, double meanLight, Belongs belongs) {
  std::vector<AuditDraw> draws = population.drawFrom(texels, kSecondLook * stratum.drawn, tracer.nextSeed());
  tracer.trace(draws);
  AuditStratum again = judge(stratum.name, draws, population, meanLight, belongs);
  again.texels = stratum.texels;
  again.wrong = isOff(again);
  stratum = std::move(again);
}

}  // namespace

double AuditStratum::detectable() const { return std::max(kAuditTolerance, kSigmas * standardError); }

double AuditReport::worst() const {
  double most = 0.0;
  const auto look = [&](const AuditStratum& stratum) {
    if (stratum.wrong) most = std::max(most, std::abs(stratum.ratio - 1.0));
  };
  look(all);
  for (const AuditStratum& stratum : decades) look(stratum);
  for (const AuditStratum& stratum : objects) look(stratum);
  return most;
}

AuditReport audit(const LightTransport& transport, const Atlas& atlas, const std::vector<PageTexels>& texels,
                  std::span<const Image* const> flat, std::span<const Image* const> aux,
                  std::span<const std::string> objectNames, const AuditOptions& options) {
  AuditReport report;
  const AuditPopulation population(atlas, texels, flat);
  if (population.size() == 0) return report;
  AuditTracer tracer(transport, atlas, texels, flat, aux, population, options);

  std::vector<AuditDraw> draws = population.draw(kPilotDraws, tracer.nextSeed());
  tracer.trace(draws);
  const double raysPerDraw = static_cast<double>(std::max<std::uint64_t>(1, tracer.rays())) / kPilotDraws;
  const auto affordable = static_cast<std::size_t>(static_cast<double>(options.rays) / raysPerDraw);
  if (affordable > kPilotDraws) {
    std::vector<AuditDraw> more = population.draw(affordable - kPilotDraws, tracer.nextSeed());
    tracer.trace(more);
    draws.insert(draws.end(), more.begin(), more.end());
  }

  const auto everything = [](const AuditDraw&) { return true; };
  report.all = judge("all", draws, population, population.meanLight(), everything);
  report.all.texels = population.size();
  std::size_t looks = 0;
  const auto mayLookAgain = [&](const AuditStratum& stratum) { return isOff(stratum) && looks++ < kMostSecondLooks; };
  if (mayLookAgain(report.all))
    lookAgain(report.all, population.everyTexel(), tracer, population, population.meanLight(), everything);

  for (int from = population.darkest(); from <= population.brightest();) {
    int to = from;
    AuditStratum stratum;
    const auto belongs = [&](const AuditDraw& draw) {
      const int decade = population.decadeOf(draw.texel);
      return decade >= from && decade <= to;
    };
    for (;; ++to) {
      stratum = judge(decadeName(from, to), draws, population, population.meanLight(), belongs);
      if (stratum.drawn >= kLeastDraws || to == population.brightest()) break;
    }
    const std::span<const std::uint32_t> members = population.ofDecades(from, to);
    stratum.texels = members.size();
    if (mayLookAgain(stratum)) lookAgain(stratum, members, tracer, population, population.meanLight(), belongs);
    if (stratum.drawn > 0) report.decades.push_back(std::move(stratum));
    from = to + 1;
  }
  for (std::uint32_t object = 0; object < objectNames.size(); ++object) {
    const std::span<const std::uint32_t> members = population.ofObject(object);
    if (members.empty()) continue;
    const auto belongs = [&](const AuditDraw& draw) { return population.objectOf(draw.texel) == object; };
    AuditStratum stratum = judge(objectNames[object], draws, population, population.meanLight(), belongs);
    stratum.texels = members.size();
    if (stratum.drawn < kLeastDraws) {
      ++report.objectsNotJudged;
      continue;
    }
    report.objects.push_back(std::move(stratum));
    AuditStratum& judged = report.objects.back();
    if (mayLookAgain(judged)) lookAgain(judged, members, tracer, population, population.meanLight(), belongs);
  }
  std::ranges::stable_sort(report.objects, [](const AuditStratum& a, const AuditStratum& b) {
    if (a.wrong != b.wrong) return a.wrong;
    return std::abs(a.ratio - 1.0) > std::abs(b.ratio - 1.0);
  });
  report.rays = tracer.rays();
  return report;
}

}  // namespace lumel

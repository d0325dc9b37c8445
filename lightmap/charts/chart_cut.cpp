#include "lightmap/charts/chart_cut.h"

#include <limits>
#include <queue>

namespace lumel {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// Per point: the border loop that it is on, or kNone. A point is on one loop and on it once: else it were several.
struct BorderLoops {
  std::vector<std::uint32_t> loopOf;
  std::uint32_t count = 0;

  explicit BorderLoops(const ChartMesh& chart) : loopOf(chart.points.size(), kNone) {
    std::vector<std::uint32_t> next(chart.points.size(), kNone);
    for (std::size_t t = 0; t < chart.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k)
        if (chart.neighbours[t][k] < 0) next[chart.triangles[t][k]] = chart.triangles[t][(k + 1) % 3];
    for (std::uint32_t start = 0; start < next.size(); ++start) {
      if (next[start] == kNone || loopOf[start] != kNone) continue;
      for (std::uint32_t at = start; at != kNone && loopOf[at] == kNone; at = next[at]) loopOf[at] = count;
      ++count;
    }
  }
};

/// By how much each loop turns left in all, were the chart laid flat: 2 pi around a disc, -2 pi around a hole, 0 around
/// the end of a pipe (Gauss and Bonnet).
std::vector<double> turning(const ChartMesh& chart, const BorderLoops& loops) {
  std::vector<double> sum(loops.count, 0.0);
  for (const std::uint32_t loop : loops.loopOf)
    if (loop != kNone) sum[loop] += std::numbers::pi;
  for (const auto& v : chart.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t loop = loops.loopOf[v[k]];
      if (loop == kNone) continue;
      const Vec3d a = chart.points[v[(k + 1) % 3]] - chart.points[v[k]];
      const Vec3d b = chart.points[v[(k + 2) % 3]] - chart.points[v[k]];
      sum[loop] -= std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
    }
  return sum;
}

/// Points from the second border to the first along edges, by the shortest way (Dijkstra 1959).
std::vector<std::uint32_t> shortestWay(const ChartMesh& chart, const BorderLoops& loops) {
  const std::size_t count = chart.points.size();
  std::vector<std::uint32_t> start(count + 1, 0);
  for (const auto& v : chart.triangles)
    for (const std::uint32_t i : v) start[i + 1] += 2;
  for (std::size_t i = 0; i < count; ++i) start[i + 1] += start[i];
  std::vector<std::uint32_t> neighbours(start.back());
  std::vector<std::uint32_t> next(start.begin(), start.end() - 1);
  for (const auto& v : chart.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      for (const std::size_t other : {(k + 1) % 3, (k + 2) % 3}) neighbours[next[v[k]]++] = v[other];

  using Step = std::pair<double, std::uint32_t>;
  std::priority_queue<Step, std::vector<Step>, std::greater<>> queue;
  std::vector<double> distance(count, std::numeric_limits<double>::infinity());
  std::vector<std::uint32_t> before(count, kNone);
  for (std::uint32_t i = 0; i < count; ++i)
    if (loops.loopOf[i] == 0) {
      distance[i] = 0;
      queue.push({0.0, i});
    }
  while (!queue.empty()) {
    const auto [length, at] = queue.top();
    queue.pop();
    if (length > distance[at]) continue;
    if (loops.loopOf[at] == 1) {
      std::vector<std::uint32_t> way;
      for (std::uint32_t i = at; i != kNone; i = before[i]) way.push_back(i);
      return way;
    }
    for (std::uint32_t i = start[at]; i < start[at + 1]; ++i) {
      const std::uint32_t to = neighbours[i];
      const double there = length + glm::length(chart.points[to] - chart.points[at]);
      if (!(there < distance[to])) continue;
      distance[to] = there;
      before[to] = at;
      queue.push({there, to});
    }
  }
  return {};
}

}  // namespace

ChartForm formOf(const ChartMesh& chart) {
  const BorderLoops loops(chart);
  if (loops.count == 0) return ChartForm::Closed;
  if (loops.count != 2) return ChartForm::Disc;
  constexpr double kNearlyAround = 0.8 * 2 * std::numbers::pi;  // a flat cone's rim: stretch takes care of the rest
  for (const double turn : turning(chart, loops))
    if (std::abs(turn) > kNearlyAround) return ChartForm::Disc;
  return ChartForm::Band;
}

void cutBand(const HalfEdgeMesh& mesh, ChartMesh& chart) {
  const std::vector<std::uint32_t> way = shortestWay(chart, BorderLoops(chart));
  std::vector<std::uint32_t> rank(chart.points.size(), kNone);
  for (std::uint32_t i = 0; i < way.size(); ++i) rank[way[i]] = i;
  for (std::size_t t = 0; t < chart.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = rank[chart.triangles[t][k]];
      const std::uint32_t b = rank[chart.triangles[t][(k + 1) % 3]];
      if (a != kNone && b != kNone && (a + 1 == b || b + 1 == a)) chart.neighbours[t][k] = -1;
    }
  weldCorners(mesh, chart);
}

}  // namespace lumel

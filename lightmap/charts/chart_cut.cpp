#include "lightmap/charts/chart_cut.h"

#include <limits>
#include <queue>

namespace lumel {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// Per vertex: the border loop that it is on, or kNone. A vertex is on one loop and on it once.
struct BorderLoops {
  std::vector<std::uint32_t> loopOf;
  std::uint32_t count = 0;

  explicit BorderLoops(const ChartMesh& chart) : loopOf(chart.vertexCount(), kNone) {
    const OpenMesh::TriConnectivity& mesh = chart.halfEdges();
    for (const OpenMesh::VertexHandle start : mesh.vertices()) {
      if (!mesh.is_boundary(start) || loopOf[static_cast<std::size_t>(start.idx())] != kNone) continue;
      // A border vertex's own half-edge is the border's.
      for (HalfedgeHandle side = mesh.halfedge_handle(start); loopOf[chart.startOf(side)] == kNone;
           side = mesh.next_halfedge_handle(side))
        loopOf[chart.startOf(side)] = count;
      ++count;
    }
  }
};

/// How far each loop would turn left in all if the chart lay flat: 2 pi around a disc, -2 pi around a hole, 0 around
/// the end of a pipe (Gauss and Bonnet).
std::vector<double> turning(const ChartMesh& chart, const BorderLoops& loops) {
  std::vector<double> sum(loops.count, 0.0);
  for (const std::uint32_t loop : loops.loopOf)
    if (loop != kNone) sum[loop] += std::numbers::pi;
  for (std::size_t t = 0; t < chart.size(); ++t) {
    const std::array<std::uint32_t, 3> v = chart.corners(t);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t loop = loops.loopOf[v[k]];
      if (loop == kNone) continue;
      const Vec3d a = chart.points[v[(k + 1) % 3]] - chart.points[v[k]];
      const Vec3d b = chart.points[v[(k + 2) % 3]] - chart.points[v[k]];
      sum[loop] -= std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
    }
  }
  return sum;
}

/// Points from the second border to the first along edges, by the shortest way (Dijkstra 1959).
std::vector<std::uint32_t> shortestWay(const ChartMesh& chart, const BorderLoops& loops) {
  const std::size_t count = chart.vertexCount();
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
    for (const OpenMesh::VertexHandle vertex :
         chart.halfEdges().vv_range(OpenMesh::VertexHandle(static_cast<int>(at)))) {
      const auto to = static_cast<std::uint32_t>(vertex.idx());
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
  std::vector<std::uint32_t> rank(chart.vertexCount(), kNone);
  for (std::uint32_t i = 0; i < way.size(); ++i) rank[way[i]] = i;
  std::vector<std::int32_t> opposite = chart.opposites();
  for (std::size_t t = 0; t < chart.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = rank[chart.startOf(chart.side(t, k))];
      const std::uint32_t b = rank[chart.endOf(chart.side(t, k))];
      if (a != kNone && b != kNone && (a + 1 == b || b + 1 == a)) opposite[3 * t + k] = -1;
    }
  chart = ChartMesh(mesh, std::move(chart.meshTriangles), opposite);
}

}  // namespace lumel

#include "ssbump/basis_file.h"

#include <fstream>
#include <sstream>
#include <string>

namespace lumel::ssbump {

Expected<std::vector<Vec3>> readBasis(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) return inputError(file.string() + ": cannot be read");
  std::vector<Vec3> basis;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const std::string place = file.string() + ":" + std::to_string(number) + ": ";
    line = line.substr(0, line.find('#'));
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    std::istringstream words(line);
    Vec3 v;
    std::string rest;
    if (!(words >> v.x >> v.y >> v.z) || (words >> rest))
      return inputError(place + "not three numbers; give x y z in (t, b, n)");
    const float length = glm::length(v);
    if (!(std::abs(length - 1) < 1e-3f))
      return inputError(place + "the vector's length is " + std::to_string(length) + "; give unit vectors");
    if (v.z <= 0) return inputError(place + "the vector does not point out of the surface (n must be above 0)");
    basis.push_back(v / length);
    if (basis.size() > 64) return inputError(place + "more than 64 vectors");
  }
  if (basis.empty()) return inputError(file.string() + ": no vectors; give one per line as x y z");
  return basis;
}

}  // namespace lumel::ssbump

#include "baker/direct_light.h"

namespace lumel {

std::vector<LightStrategy> lightStrategies(const LightTransport& transport, bool separate) {
  std::vector<LightStrategy> strategies;
  if (separate && transport.punctual.size() <= kSeparateLights) {
    for (std::size_t i = 0; i < transport.punctual.size(); ++i) strategies.push_back({LightStrategy::OnePunctual, i});
  } else if (!transport.punctual.empty()) {
    strategies.push_back({LightStrategy::EveryPunctual});
  }
  if (!transport.emissive.empty()) strategies.push_back({LightStrategy::Emissive});
  if (transport.environment.sunSampled()) strategies.push_back({LightStrategy::Sun});
  if (transport.environment.skySampled()) strategies.push_back({LightStrategy::Sky});
  return strategies;
}

}  // namespace lumel

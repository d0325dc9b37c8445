#include "baker/direct_light.h"

namespace lumel {

std::vector<LightStrategy> lightStrategies(const LightTransport& transport, bool separate) {
  std::vector<LightStrategy> strategies;
  const PunctualLights& lights = transport.punctual;
  std::size_t alone = 0;
  if (separate && lights.size() <= kSeparateLights)
    alone = lights.size();
  else if (separate && lights.directional() < kSeparateLights)
    alone = lights.directional();
  for (std::size_t i = 0; i < alone; ++i) strategies.push_back({LightStrategy::OnePunctual, i});
  if (alone < lights.size())
    strategies.push_back({alone > 0 ? LightStrategy::NearPunctual : LightStrategy::EveryPunctual});
  if (!transport.emissive.empty()) strategies.push_back({LightStrategy::Emissive});
  if (transport.environment.sunSampled()) strategies.push_back({LightStrategy::Sun});
  if (transport.environment.skySampled()) strategies.push_back({LightStrategy::Sky});
  return strategies;
}

}  // namespace lumel

#include "baker/commands/encoding_list.h"

#include <vector>

#include "scene/base/split_text.h"

namespace lumel {

Expected<std::shared_ptr<const Encoding>> encodingsOf(const std::string& list, Projection projection) {
  std::vector<std::shared_ptr<const Encoding>> encodings;
  for (const std::string& name : splitText(list, ',')) {
    const auto found = findEncoding(name, {{"projection", nameOf(projection)}});
    if (!found) {
      std::string known;
      for (const EncodingSummary& summary : encodingSummaries()) known += (known.empty() ? "" : ", ") + summary.name;
      return usageError("--encoding: '" + name + "' is not one of " + known);
    }
    for (const auto& other : encodings)
      if (other->name() == name) return usageError("--encoding: " + name + " is there twice");
    encodings.push_back(*found);
  }
  auto joint = jointEncoding(std::move(encodings));
  if (!joint) return usageError("--encoding: " + joint.error().message);
  return joint;
}

std::string describeEncodingChoices() {
  constexpr std::size_t kColumn = 12;
  std::string text = "Encodings (--encoding)\n";
  for (const EncodingSummary& summary : encodingSummaries()) {
    std::string line = "  " + summary.name;
    line.resize(kColumn, ' ');
    text += line + summary.text + "\n";
  }
  return text + "\n";
}

}  // namespace lumel

// The value of --encoding: a list of encodings.
#pragma once

#include <memory>
#include <string>

#include "lightmap/maps/encoding.h"

namespace lumel {

/// The encodings on a list with commas between, sampled together (jointEncoding). Errors: Usage, naming what is wrong
/// with the list.
Expected<std::shared_ptr<const Encoding>> encodingsOf(const std::string& list, Projection projection);

/// A heading and a line for each encoding, for the end of a help text.
std::string describeEncodingChoices();

}  // namespace lumel

// Whether a message says what it should.
#pragma once

#include <gtest/gtest.h>

#include <string>

namespace lumel {

/// Passes if `part` occurs in `text`; a failure shows both.
inline testing::AssertionResult mentions(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "no '" << part << "' in '" << text << "'";
}

}  // namespace lumel

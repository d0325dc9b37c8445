#pragma once

namespace lumel {

inline constexpr const char* kVersion = LUMEL_VERSION;

}  // namespace lumel

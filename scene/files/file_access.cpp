#include "scene/files/file_access.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <system_error>

namespace lumel {
namespace fs = std::filesystem;
namespace {

constexpr std::array<std::int8_t, 256> base64Table() {
  std::array<std::int8_t, 256> table{};
  for (auto& value : table) value = -1;
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < digits.size(); ++i)
    table[static_cast<unsigned char>(digits[i])] = static_cast<std::int8_t>(i);
  return table;
}

int hexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// "http:", "file:", "C:": letters and digits up to a colon that comes before any slash.
bool hasScheme(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c == ':') return i > 0;
    if (!std::isalnum(c) && c != '+' && c != '-' && c != '.') return false;
  }
  return false;
}

bool isInside(const fs::path& file, const fs::path& folder) {
  auto f = file.begin();
  for (const auto& part : folder) {
    if (part.empty()) continue;
    if (f == file.end() || *f != part) return false;
    ++f;
  }
  return f != file.end();
}

}  // namespace

std::string lowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string lowerCaseExtension(const fs::path& file) { return lowerCase(file.extension().string()); }

Expected<std::vector<std::uint8_t>> readFile(const fs::path& file) {
  std::error_code ec;
  const auto status = fs::status(file, ec);
  if (!fs::exists(status)) return inputError(file.string() + ": no such file");
  if (!fs::is_regular_file(status))
    return inputError(file.string() + ": is not a file" + (fs::is_directory(status) ? " but a folder" : ""));
  const auto size = fs::file_size(file, ec);
  if (ec) return inputError(file.string() + ": cannot be read: " + ec.message());
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> in(std::fopen(file.c_str(), "rb"), &std::fclose);
  if (!in) return inputError(file.string() + ": cannot be read: " + std::strerror(errno));
  std::vector<std::uint8_t> bytes(size);
  if (std::fread(bytes.data(), 1, bytes.size(), in.get()) != bytes.size())
    return inputError(file.string() + ": cannot be read to its end");
  return bytes;
}

Expected<std::vector<std::uint8_t>> decodeDataUri(std::string_view uri) {
  const auto comma = uri.find(',');
  if (comma == std::string_view::npos) return inputError("is a data URI without a comma");
  const std::string_view header = uri.substr(0, comma);
  const std::string_view text = uri.substr(comma + 1);
  if (header.size() < 7 || header.substr(header.size() - 7) != ";base64") {
    const std::string plain = percentDecode(text);
    return std::vector<std::uint8_t>(plain.begin(), plain.end());
  }
  static constexpr auto kTable = base64Table();
  std::vector<std::uint8_t> bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int pending = 0;
  for (std::size_t i = 0; i < text.size() && text[i] != '='; ++i) {
    const auto value = kTable[static_cast<unsigned char>(text[i])];
    if (value < 0)
      return inputError("is a data URI with a character that is not base64 at position " + std::to_string(i));
    bits = (bits << 6 | static_cast<std::uint32_t>(value)) & 0xFFFFFFu;
    pending += 6;
    if (pending >= 8) {
      pending -= 8;
      bytes.push_back(static_cast<std::uint8_t>(bits >> pending));
    }
  }
  return bytes;
}

std::string percentDecode(std::string_view text) {
  std::string decoded;
  decoded.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size()) {
      const int high = hexDigit(text[i + 1]);
      const int low = hexDigit(text[i + 2]);
      if (high >= 0 && low >= 0) {
        decoded.push_back(static_cast<char>(high * 16 + low));
        i += 2;
        continue;
      }
    }
    decoded.push_back(text[i]);
  }
  return decoded;
}

Expected<fs::path> resolveReference(const fs::path& folder, const std::string& reference, const LoadOptions& options) {
  if (reference.empty() || reference.find('\0') != std::string::npos) return inputError("is not a file name");
  if (hasScheme(reference) && !(reference.size() > 1 && reference[1] == ':'))
    return inputError("'" + reference + "' is not a relative path; only files beside the scene are read");
  std::error_code ec;
  const fs::path base = fs::weakly_canonical(folder.empty() ? fs::path(".") : folder, ec);
  if (ec) return inputError("the scene's folder cannot be resolved: " + ec.message());
  const fs::path file = fs::weakly_canonical(base / reference, ec);
  if (ec) return inputError("'" + reference + "' cannot be resolved: " + ec.message());
  if (!options.allowOutsidePaths && (fs::path(reference).is_absolute() || !isInside(file, base)))
    return inputError("'" + reference + "' leaves the scene's folder; move the file there, or allow paths outside it");
  return file;
}

}  // namespace lumel

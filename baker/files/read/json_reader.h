// JSON of our own files, as whoever edited them left it.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "scene/base/expected.h"
#include "scene/base/math.h"

namespace lumel {

/// Access to JSON that may hold anything; the path names the place in messages.
class JsonReader {
 public:
  JsonReader(const nlohmann::ordered_json& json, std::string file, std::string path = "")
      : json_(&json), file_(std::move(file)), path_(std::move(path)) {}

  Expected<JsonReader> at(const std::string& key) const {
    const auto found = json_->is_object() ? json_->find(key) : json_->end();
    if (found == json_->end()) return inputError(file_ + ": " + path_ + "/" + key + " is missing; bake again");
    return JsonReader(*found, file_, path_ + "/" + key);
  }
  Expected<std::string> textAt(const std::string& key) const {
    auto value = at(key);
    if (!value) return value.error();
    if (!value->json_->is_string()) return value->wrong("a text");
    return value->json_->get<std::string>();
  }
  Expected<double> numberAt(const std::string& key) const {
    auto value = at(key);
    if (!value) return value.error();
    if (!value->json_->is_number()) return value->wrong("a number");
    return value->json_->get<double>();
  }
  Expected<Vec3> vectorAt(const std::string& key) const {
    auto value = at(key);
    if (!value) return value.error();
    const nlohmann::ordered_json& array = *value->json_;
    if (!array.is_array() || array.size() != 3 || !array[0].is_number() || !array[1].is_number() ||
        !array[2].is_number())
      return value->wrong("three numbers");
    return Vec3(array[0].get<float>(), array[1].get<float>(), array[2].get<float>());
  }
  const nlohmann::ordered_json& json() const { return *json_; }
  Error wrong(const std::string& wanted) const { return inputError(file_ + ": " + path_ + " is not " + wanted); }

 private:
  const nlohmann::ordered_json* json_;
  std::string file_;
  std::string path_;
};

}  // namespace lumel

// A study as files: tables for people and programs, and plots.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "baker/study/study.h"

namespace lumel {

/// One row per bake, with a heading. Columns that do not apply are empty.
std::string studyCsv(const Study& study);

/// The same with the reference, what was left out and the settings.
std::string studyJson(const Study& study, const nlohmann::ordered_json& settings);

/// Tables for a README (Markdown).
std::string studyMarkdown(const Study& study, const std::string& scene);

/// study.csv, study.json, study.md, and the plots error-rays.svg, error-time.svg and density.svg, all or none of them.
/// Errors: Failed.
Expected<void> writeStudy(const std::filesystem::path& dir, const Study& study, const std::string& scene,
                          const nlohmann::ordered_json& settings);

}  // namespace lumel

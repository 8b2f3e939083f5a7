#include "colmap_graphmatch/cli/option_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/lexical_cast.hpp>
#include <cctype>
#include <cmath>

namespace colmap_graphmatch {
namespace {

template <typename T>
std::optional<T> Number(const std::string& text) {
  T value{};
  return boost::conversion::try_lexical_convert(text, value) ? std::optional<T>(value)
                                                             : std::nullopt;
}

// lexical_cast takes -2 for a great number.
template <typename T>
std::optional<T> Unsigned(const std::string& text) {
  return text.find('-') == std::string::npos ? Number<T>(text) : std::nullopt;
}

// Stores a value that is there.
template <typename T>
bool Store(const std::optional<T>& value, T* field) {
  if (value) *field = *value;
  return value.has_value();
}

const std::vector<std::string>& BoolChoices() {
  static const std::vector<std::string> choices = {"0", "1"};
  return choices;
}

}  // namespace

Value Flag(bool* field) {
  return {"", "", [field](const std::string&) { return *field = true; }};
}

Value BoolOf(bool* field) {
  return {"0 or 1", *field ? "1" : "0",
          [field](const std::string& text) { return Store(ParseBool(text), field); },
          BoolChoices()};
}

Value IntOf(int* field, int minimum) {
  return {fmt::format("an integer of at least {}", minimum), std::to_string(*field),
          [field, minimum](const std::string& text) {
            const std::optional<int> value = Number<int>(text);
            return value && *value >= minimum && Store(value, field);
          }};
}

Value IntOf(int* field, int minimum, int maximum) {
  return {fmt::format("an integer from {} to {}", minimum, maximum), std::to_string(*field),
          [field, minimum, maximum](const std::string& text) {
            const std::optional<int> value = Number<int>(text);
            return value && *value >= minimum && *value <= maximum && Store(value, field);
          }};
}

Value NumThreadsOf(int* field) {
  return {"an integer; below 1: all cores", std::to_string(*field),
          [field](const std::string& text) {
            const std::optional<int> value = Number<int>(text);
            if (value) *field = *value < 1 ? -1 : *value;
            return value.has_value();
          }};
}

Value CountOf(std::size_t* field) {
  return {"an integer of at least 0", std::to_string(*field),
          [field](const std::string& text) { return Store(Unsigned<std::size_t>(text), field); }};
}

Value SeedOf(std::uint64_t* field, bool* from_clock) {
  return {"an integer of at least 0, or -1: another one in every run", std::to_string(*field),
          [field, from_clock](const std::string& text) {
            *from_clock = text == "-1";
            return *from_clock || Store(Unsigned<std::uint64_t>(text), field);
          }};
}

Value DoubleOf(double* field, Zero zero) {
  const bool allowed = zero == Zero::kAllowed;
  return {allowed ? "a number of at least 0" : "a number greater than 0", fmt::format("{}", *field),
          [field, allowed](const std::string& text) {
            const std::optional<double> value = Number<double>(text);
            return value && std::isfinite(*value) && (*value > 0 || (allowed && *value == 0)) &&
                   Store(value, field);
          }};
}

Value FeatureTypeOf(bool* lightglue) {
  return {"one of SIFT, SIFT_BRUTEFORCE, SIFT_LIGHTGLUE: only SIFT features are matched",
          "",
          [lightglue](const std::string& text) {
            *lightglue = text == "SIFT_LIGHTGLUE";
            return *lightglue || text == "SIFT_BRUTEFORCE" || text == "SIFT";
          },
          {"SIFT", "SIFT_BRUTEFORCE", "SIFT_LIGHTGLUE"}};
}

Value Anything() {
  return {"anything", "", [](const std::string&) { return true; }};
}

CheckedText BoolText() {
  return {"0 or 1",
          [](std::string* text) {
            const std::optional<bool> value = ParseBool(*text);
            if (value) *text = *value ? "1" : "0";
            return value.has_value();
          },
          BoolChoices()};
}

CheckedText IntText(int minimum) {
  return {fmt::format("an integer of at least {}", minimum), [minimum](const std::string* text) {
            const std::optional<int> value = Number<int>(*text);
            return value && *value >= minimum;
          }};
}

CheckedText ShareText() {
  return {"a number from 0 to 1", [](const std::string* text) {
            const std::optional<double> value = Number<double>(*text);
            return value && *value >= 0 && *value <= 1;
          }};
}

CheckedText PositiveText() {
  return {"a number greater than 0", [](const std::string* text) {
            const std::optional<double> value = Number<double>(*text);
            return value && std::isfinite(*value) && *value > 0;
          }};
}

CheckedText AnyText() {
  return {"a text", [](const std::string*) { return true; }};
}

void Store(const std::string& checked, std::optional<bool>* field) { *field = checked == "1"; }

void Store(const std::string& checked, std::optional<int>* field) { *field = Number<int>(checked); }

void Store(const std::string& checked, std::optional<double>* field) {
  *field = Number<double>(checked);
}

std::optional<bool> ParseBool(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const char* word : {"1", "true", "yes", "on"}) {
    if (text == word) return true;
  }
  for (const char* word : {"0", "false", "no", "off"}) {
    if (text == word) return false;
  }
  return std::nullopt;
}

}  // namespace colmap_graphmatch

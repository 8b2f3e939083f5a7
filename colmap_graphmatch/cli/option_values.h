#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/enum_words.h"
#include "colmap_graphmatch/cli/option_table.h"

namespace colmap_graphmatch {

// What an option may be, in words and as a function that stores it; see OptionRow for the members.
// Values that are made for a field have what is in the field as their default.
struct Value {
  std::string values;
  std::string default_value;
  std::function<bool(const std::string&)> read;
  std::vector<std::string> choices = {};
  OptionRow::Path path = OptionRow::Path::kNone;
};

Value Flag(bool* field);
Value BoolOf(bool* field);
Value IntOf(int* field, int minimum);
Value IntOf(int* field, int minimum, int maximum);

// As COLMAP takes them: every number below 1 for all cores.
Value NumThreadsOf(int* field);

// 0 stands for no limit.
Value CountOf(std::size_t* field);

// -1 stands for a seed from the clock, as in COLMAP; the seed then stays as it is.
Value SeedOf(std::uint64_t* field, bool* from_clock);

enum class Zero { kAllowed, kNotAllowed };
Value DoubleOf(double* field, Zero zero);

// COLMAP's types of features and of their matching, of which those for SIFT are taken.
Value FeatureTypeOf(bool* lightglue);

Value Anything();

// std::string or a path.
template <typename T>
Value TextOf(T* field, const std::string& values, OptionRow::Path path = OptionRow::Path::kFile) {
  return {values,
          std::string(*field),
          [field](const std::string& text) {
            *field = text;
            return !text.empty();
          },
          {},
          path};
}

// Nothing is as good as not given.
template <typename T>
Value TextOrNothingOf(T* field, const std::string& values) {
  return {values + ", or nothing",
          "",
          [field](const std::string& text) {
            *field = text;
            return true;
          },
          {},
          OptionRow::Path::kFile};
}

// The words in alphabetical order.
template <typename Enum, std::size_t N>
Value OneOf(Enum* field, const EnumWords<Enum, N>& words) {
  std::map<std::string, Enum> named;
  for (const EnumWord<Enum>& entry : words) named.emplace(entry.word, entry.value);
  Value value;
  value.default_value = WordOf(words, *field);
  for (const auto& [word, entry] : named) {
    value.values += (value.values.empty() ? "one of " : ", ") + word;
    value.choices.push_back(word);
  }
  value.read = [field, named](const std::string& text) {
    const auto found = named.find(text);
    if (found != named.end()) *field = found->second;
    return found != named.end();
  };
  return value;
}

// The text of a value that goes on to COLMAP: `check` says whether it may, and spells it as every
// version reads it.
struct CheckedText {
  std::string values;
  std::function<bool(std::string*)> check;
  std::vector<std::string> choices = {};
};

CheckedText BoolText();
CheckedText IntText(int minimum);
CheckedText ShareText();  // From 0 to 1.
CheckedText PositiveText();
CheckedText AnyText();

// The number or truth that a checked text stands for.
void Store(const std::string& checked, std::optional<bool>* field);
void Store(const std::string& checked, std::optional<int>* field);
void Store(const std::string& checked, std::optional<double>* field);

// The words for truth that COLMAP understands, in any case (Boost.Program_options' own): true, yes,
// on, 1 and their opposites.
std::optional<bool> ParseBool(std::string text);

}  // namespace colmap_graphmatch

#include "colmap_graphmatch/encoding/numpy_file.h"

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <regex>
#include <system_error>
#include <unordered_set>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/input_file.h"
#include "colmap_graphmatch/base/output_file.h"

namespace colmap_graphmatch {
namespace {

constexpr std::array<char, 6> kMagic = {'\x93', 'N', 'U', 'M', 'P', 'Y'};
constexpr std::size_t kHeaderAlignment = 64;
// That of two dimensions has 118 characters. std::regex needs stack for every one.
constexpr std::size_t kMaxHeaderSize = 1024;

[[noreturn]] void ThrowNot(const std::filesystem::path& path, const std::string& what) {
  throw FileError(path.string() + " " + what +
                  ". It must be a two-dimensional NumPy array, as numpy.save(path, "
                  "numpy.ascontiguousarray(vectors, dtype=\"float32\")) writes it.");
}

struct Header {
  bool is_double = false;
  std::size_t num_rows = 0;
  std::size_t dim = 0;
};

// The dictionary of the header, a literal of Python.
Header ParseHeader(const std::filesystem::path& path, const std::string& text) {
  std::smatch found;
  if (!std::regex_search(text, found, std::regex("'descr' *: *'([^']*)'"))) {
    ThrowNot(path, "has no single type of numbers");
  }
  const std::string type = found[1];
  if (type != "<f4" && type != "<f8") {
    ThrowNot(path, "has numbers of the type \"" + type + "\", not float32 (<f4) or float64 (<f8)");
  }
  if (!std::regex_search(text, std::regex("'fortran_order' *: *False"))) {
    ThrowNot(path, "is stored column by column (Fortran order), not row by row");
  }
  const std::regex shape("'shape' *: *\\( *([0-9]{1,18}) *, *([0-9]{1,18}) *,? *\\)");
  if (!std::regex_search(text, found, shape)) ThrowNot(path, "does not have two dimensions");
  Header header;
  header.is_double = type == "<f8";
  header.num_rows = std::stoull(found[1]);
  header.dim = std::stoull(found[2]);
  return header;
}

Header ReadHeader(const std::filesystem::path& path, std::ifstream* file) {
  std::array<char, 8> begin = {};
  if (!file->read(begin.data(), begin.size()) ||
      std::memcmp(begin.data(), kMagic.data(), kMagic.size()) != 0) {
    ThrowNot(path, "is not a .npy file");
  }
  const auto version = static_cast<unsigned char>(begin[6]);
  if (version < 1 || version > 3) {
    ThrowNot(path, "has version " + std::to_string(version) + " of the format");
  }
  std::array<unsigned char, 4> bytes = {};
  file->read(reinterpret_cast<char*>(bytes.data()), version == 1 ? 2 : 4);
  std::size_t size = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) size = size << 8U | bytes[i];
  if (!*file || size > kMaxHeaderSize) ThrowNot(path, "has a damaged header");
  std::string text(size, '\0');
  if (!file->read(text.data(), static_cast<std::streamsize>(size))) {
    ThrowNot(path, "ends within its header");
  }
  return ParseHeader(path, text);
}

template <typename Number>
void ReadRows(const std::filesystem::path& path, std::ifstream* file, NamedVectors* vectors) {
  const std::size_t num_rows = vectors->names.size();
  std::vector<Number> row(vectors->dim);
  for (std::size_t i = 0; i < num_rows; ++i) {
    const auto size = static_cast<std::streamsize>(row.size() * sizeof(Number));
    if (!file->read(reinterpret_cast<char*>(row.data()), size)) {
      throw FileError("Cannot read " + path.string() + " to its end: " + std::strerror(errno) +
                      ".");
    }
    for (const Number value : row) {
      const auto as_float = static_cast<float>(value);
      if (!std::isfinite(as_float)) {
        throw FileError("Row " + std::to_string(i) + " of " + path.string() + " (" +
                        vectors->names[i] + ") has an entry that is not a finite float32.");
      }
      vectors->rows.push_back(as_float);
    }
  }
}

std::ifstream OpenNames(const std::filesystem::path& path) {
  try {
    return OpenRegularFile(path);
  } catch (const UnreadableFileError& error) {
    throw FileError(error.what() +
                    std::string(" It must have the image names of the rows, one a line, in their "
                                "order."));
  }
}

std::vector<std::string> ReadNames(const std::filesystem::path& path, std::size_t num_rows) {
  std::ifstream file = OpenNames(path);
  std::vector<std::string> names;
  std::unordered_set<std::string> seen;
  for (std::string line; std::getline(file, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (!seen.insert(line).second) {
      throw FileError("Line " + std::to_string(names.size() + 1) + " of " + path.string() +
                      " has the name \"" + line + "\" again.");
    }
    names.push_back(line);
  }
  if (names.size() != num_rows) {
    throw FileError(path.string() + " has " + std::to_string(names.size()) +
                    " names, but the array beside it has " + std::to_string(num_rows) + " rows.");
  }
  return names;
}

}  // namespace

std::filesystem::path NamesPath(std::filesystem::path path) {
  return path.replace_extension(".txt");
}

NamedVectors ReadNamedVectors(const std::filesystem::path& path) {
  std::ifstream file = OpenRegularFile(path);
  const Header header = ReadHeader(path, &file);
  // A header can ask for any amount of memory.
  const std::uintmax_t begin = static_cast<std::uintmax_t>(file.tellg());
  const std::uintmax_t size = std::filesystem::file_size(path) - begin;
  const std::size_t bytes = header.is_double ? sizeof(double) : sizeof(float);
  const bool is_empty = header.num_rows == 0 || header.dim == 0;
  if (is_empty || header.dim > std::numeric_limits<std::size_t>::max() / bytes / header.num_rows ||
      header.num_rows * header.dim * bytes != size) {
    ThrowNot(path, "has " + std::to_string(size) + " bytes of numbers, and its header says " +
                       std::to_string(header.num_rows) + " x " + std::to_string(header.dim));
  }
  NamedVectors vectors;
  vectors.names = ReadNames(NamesPath(path), header.num_rows);
  vectors.dim = header.dim;
  vectors.rows.reserve(header.num_rows * header.dim);
  if (header.is_double) {
    ReadRows<double>(path, &file, &vectors);
  } else {
    ReadRows<float>(path, &file, &vectors);
  }
  return vectors;
}

void WriteNamedVectors(const std::filesystem::path& path, const NamedVectors& vectors) {
  for (const std::string& name : vectors.names) {
    if (name.find('\n') == std::string::npos) continue;
    throw FileError("Cannot write " + NamesPath(path).string() + ": the image name \"" + name +
                    "\" has a line end in it.");
  }
  WriteWholeFile(path, [&](std::ostream& file) {
    std::string text = "{'descr': '<f4', 'fortran_order': False, 'shape': (" +
                       std::to_string(vectors.names.size()) + ", " + std::to_string(vectors.dim) +
                       "), }";
    const std::size_t before = kMagic.size() + 4;  // The magic, the version, the length.
    while ((before + text.size() + 1) % kHeaderAlignment != 0) text += ' ';
    text += '\n';
    file.write(kMagic.data(), kMagic.size());
    for (const std::size_t byte :
         {std::size_t{1}, std::size_t{0}, text.size() & 0xFFU, text.size() >> 8U}) {
      file.put(static_cast<char>(byte));
    }
    file << text;
    file.write(reinterpret_cast<const char*>(vectors.rows.data()),
               static_cast<std::streamsize>(vectors.rows.size() * sizeof(float)));
  });
  WriteWholeFile(NamesPath(path), [&](std::ostream& file) {
    for (const std::string& name : vectors.names) file << name << '\n';
  });
}

}  // namespace colmap_graphmatch

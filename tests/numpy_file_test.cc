#include "colmap_graphmatch/encoding/numpy_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "colmap_graphmatch/base/errors.h"
#include "tests/support/synthetic_database.h"

namespace colmap_graphmatch {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class NumpyFileTest : public ::testing::Test {
 protected:
  // A file as numpy.save writes it, and names beside it.
  template <typename Number>
  void Write(const std::string& dictionary, const std::vector<Number>& numbers,
             const std::string& names, int version = 1) {
    std::string header = dictionary + "\n";
    const std::size_t length_bytes = version == 1 ? 2 : 4;
    std::ofstream file(path_, std::ios::binary);
    file << "\x93NUMPY" << static_cast<char>(version) << '\0';
    for (std::size_t i = 0; i < length_bytes; ++i) {
      file.put(static_cast<char>(header.size() >> (8 * i) & 0xFFU));
    }
    file << header;
    file.write(reinterpret_cast<const char*>(numbers.data()),
               static_cast<std::streamsize>(numbers.size() * sizeof(Number)));
    std::ofstream(directory_.Path() / "vectors.txt") << names;
  }

  void ExpectError(const std::string& message) {
    EXPECT_THAT([&] { ReadNamedVectors(path_); }, ThrowsMessage<FileError>(HasSubstr(message)));
  }

  TestDirectory directory_;
  std::filesystem::path path_ = directory_.Path() / "vectors.npy";
};

const char kFloats[] = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }";
const std::vector<float> kNumbers = {1, 2, 3, 4, 5, 6};

TEST_F(NumpyFileTest, WhatIsWrittenIsReadAgain) {
  NamedVectors vectors;
  vectors.names = {"a.jpg", "folder/b c.jpg"};
  vectors.dim = 3;
  vectors.rows = kNumbers;
  WriteNamedVectors(path_, vectors);
  const NamedVectors read = ReadNamedVectors(path_);
  EXPECT_EQ(read.names, vectors.names);
  EXPECT_EQ(read.dim, 3U);
  EXPECT_EQ(read.rows, vectors.rows);
  EXPECT_EQ(std::filesystem::file_size(path_), 128 + 6 * sizeof(float));
  EXPECT_FALSE(std::filesystem::exists(directory_.Path() / "vectors.npy.partial"));
}

TEST_F(NumpyFileTest, FloatsAndDoublesOfEveryVersion) {
  for (const int version : {1, 2, 3}) {
    Write(kFloats, kNumbers, "a\nb\n", version);
    EXPECT_THAT(ReadNamedVectors(path_).rows, ElementsAre(1, 2, 3, 4, 5, 6));
    Write("{'shape':(1,2),'descr':'<f8','fortran_order':False}", std::vector<double>{0.5, -2},
          "a\r\n", version);
    const NamedVectors read = ReadNamedVectors(path_);
    EXPECT_THAT(read.rows, ElementsAre(0.5, -2));
    EXPECT_THAT(read.names, ElementsAre("a"));
  }
}

TEST_F(NumpyFileTest, OtherArrays) {
  Write("{'descr': '<i8', 'fortran_order': False, 'shape': (2, 3), }", kNumbers, "a\nb\n");
  ExpectError("numbers of the type \"<i8\"");
  Write("{'descr': '<f4', 'fortran_order': True, 'shape': (2, 3), }", kNumbers, "a\nb\n");
  ExpectError("column by column");
  Write("{'descr': '<f4', 'fortran_order': False, 'shape': (6,), }", kNumbers, "a\nb\n");
  ExpectError("two dimensions");
  Write("{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (2, 3), }", kNumbers, "a\nb\n");
  ExpectError("no single type");
  Write(kFloats, kNumbers, "a\nb\n", 4);
  ExpectError("version 4");
  std::ofstream(path_) << "PK\x03\x04 an archive";
  ExpectError("is not a .npy file");
  std::filesystem::remove(path_);
  ExpectError("No such file");
}

// A long type, and a pipe.
TEST_F(NumpyFileTest, HostileFiles) {
  Write("{'descr': '" + std::string(60000, 'f') + "', 'shape': (2, 3)}", kNumbers, "a\nb\n");
  ExpectError("damaged header");
  std::filesystem::remove(path_);
  ASSERT_EQ(::mkfifo(path_.c_str(), 0600), 0);
  ExpectError("not a regular file");
}

TEST_F(NumpyFileTest, SizesThatDoNotFit) {
  Write(kFloats, std::vector<float>{1, 2, 3}, "a\nb\n");
  ExpectError("12 bytes of numbers");
  Write("{'descr': '<f4', 'fortran_order': False, 'shape': (0, 3), }", std::vector<float>(), "");
  ExpectError("0 x 3");
  for (const char* shape : {"4611686018427387905, 4", "999999999999999999, 999999999999999999",
                            "4294967296, 4294967296", "99999999999999999999, 1"}) {
    Write("{'descr': '<f4', 'fortran_order': False, 'shape': (" + std::string(shape) + "), }",
          kNumbers, "a\nb\n");
    EXPECT_THROW(ReadNamedVectors(path_), FileError) << shape;
  }
  Write(kFloats, kNumbers, "a\nb\n");
  std::filesystem::resize_file(path_, 20);
  ExpectError("ends within its header");
  std::filesystem::resize_file(path_, 9);
  ExpectError("damaged header");
}

TEST_F(NumpyFileTest, NumbersThatAreNone) {
  for (const float value :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    std::vector<float> numbers = kNumbers;
    numbers[4] = value;
    Write(kFloats, numbers, "a\nb\n");
    ExpectError("Row 1 of " + path_.string() + " (b)");
  }
  Write("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1), }", std::vector<double>{1e300},
        "a\n");
  ExpectError("not a finite float32");
}

TEST_F(NumpyFileTest, NamesThatDoNotFit) {
  Write(kFloats, kNumbers, "a\n");
  ExpectError("1 names, but the array beside it has 2 rows");
  Write(kFloats, kNumbers, "a\na\n");
  ExpectError("Line 2");
  std::filesystem::remove(directory_.Path() / "vectors.txt");
  ExpectError("the image names of the rows");
}

TEST_F(NumpyFileTest, WhereItCannotBeWritten) {
  NamedVectors vectors;
  vectors.names = {"a"};
  vectors.dim = 1;
  vectors.rows = {1};
  EXPECT_THROW(WriteNamedVectors(directory_.Path() / "none" / "v.npy", vectors), FileError);
  vectors.names = {"a\nb"};
  EXPECT_THAT([&] { WriteNamedVectors(path_, vectors); },
              ThrowsMessage<FileError>(HasSubstr("line end")));
}

}  // namespace
}  // namespace colmap_graphmatch

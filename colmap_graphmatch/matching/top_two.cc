#include "colmap_graphmatch/matching/top_two.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>

#include "colmap_graphmatch/matching/top_two_testing.h"

// AVX-512 with VNNI; Highway leaves it out unless asked.
#define HWY_WANT_AVX3_DL

// Highway compiles this file once for each instruction set and picks one when the program runs.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "colmap_graphmatch/matching/top_two.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// Whether the target is NEON of 64-bit Arm, and whether its dot products can be written. Clang
// takes no instructions in assembly that it does not compile for.
#undef GRAPHMATCH_NEON
#undef GRAPHMATCH_NEON_DOT
#if HWY_ARCH_ARM_A64 && HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128
#define GRAPHMATCH_NEON 1
#else
#define GRAPHMATCH_NEON 0
#endif
#if GRAPHMATCH_NEON && (defined(__ARM_FEATURE_DOTPROD) || !defined(__clang__))
#define GRAPHMATCH_NEON_DOT 1
#else
#define GRAPHMATCH_NEON_DOT 0
#endif

// A block of columns (descriptors b) is packed so that a vector has the same entries of as many
// columns as it has lanes; rows (descriptors a) are broadcast against it. All 128 entries of a tile
// of rows and columns are summed up in registers. A sum then becomes a key,
//
//   key = 128 product + (127 - index of the column's vector in the block),
//
// so that the maximum over the vectors of a row is at once the greatest product and the first
// vector that has it, and its lane is the column. A product is at most 128 * 255^2 < 2^23, a key
// less than 2^31. In a column all keys have the same index: they compare as the products do.
HWY_BEFORE_NAMESPACE();
namespace colmap_graphmatch {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t kDim = 128;
constexpr int kIndexBits = 7;

// Columns of the tile, in vectors.
constexpr std::size_t kTileVectors = 2;

// Vectors a block: 132 KB or less with the fastest arithmetic of a processor (260 KB with AVX-512
// without VNNI), which stays in the second-level cache while all rows pass.
constexpr std::size_t kBlockVectors = 64;
static_assert(kBlockVectors <= std::size_t{1} << kIndexBits);

using Tag = hn::ScalableTag<std::int32_t>;
using Vector = hn::Vec<Tag>;

HWY_INLINE Vector IndexOfVector(std::size_t vector) {
  return hn::Set(Tag(), static_cast<std::int32_t>((1 << kIndexBits) - 1 - vector));
}

HWY_INLINE Vector ToKey(Vector product, std::size_t vector) {
  return hn::Or(hn::ShiftLeft<kIndexBits>(product), IndexOfVector(vector));
}

// How products are summed up. A word of 32 bits contains kEntries entries of a descriptor. PackA
// and PackB make words; Start gives the sum before the first word, for a vector of columns whose
// entries sum up to column_sums; Key makes a key of the final sum.
//
// Multiply-adds of integers are written in assembly because of what compilers make of the
// intrinsics: GCC 12 moves the multiplications of a step before its additions, or copies the sums,
// and has to spill them; twice as slow (docs/benchmarks.md). It also reaches instructions that are
// newer than the targets of Highway 1.0.
//
// Highway numbers better targets lower; those of x86 come before all others.
//
// Tiles have 6 rows where there are 16 registers for vectors, and 12 where there are 32.

std::uint32_t FourBytes(const std::uint8_t* entries) {
  std::uint32_t word = 0;
  std::memcpy(&word, entries, sizeof(word));
  return word;
}

#if HWY_TARGET <= HWY_AVX3_DL || HWY_TARGET == HWY_AVX2
// Unsigned times signed bytes, four at a time (VNNI): a is shifted by -128 to be signed, which the
// start makes good.
struct ByteArithmetic {
  static constexpr std::size_t kEntries = 4;
  static constexpr std::size_t kTileRows = HWY_TARGET <= HWY_AVX3_DL ? 12 : 6;

  static std::uint32_t PackA(const std::uint8_t* entries) {
    return FourBytes(entries) ^ 0x80808080U;
  }
  static std::uint32_t PackB(const std::uint8_t* entries) { return FourBytes(entries); }
  static HWY_INLINE Vector Start(Vector column_sums, std::size_t /*vector*/) {
    return hn::ShiftLeft<7>(column_sums);
  }
  static HWY_INLINE Vector MulAdd(Vector a, Vector b, Vector sum) {
#if HWY_TARGET <= HWY_AVX3_DL
    asm("vpdpbusd %[a],%[b],%[sum]" : [sum] "+v"(sum.raw) : [a] "v"(a.raw), [b] "v"(b.raw));
#else
    asm("%{vex%} vpdpbusd %[a],%[b],%[sum]" : [sum] "+x"(sum.raw) : [a] "x"(a.raw), [b] "x"(b.raw));
#endif
    return sum;
  }
  static HWY_INLINE Vector Key(Vector sum, std::size_t vector) { return ToKey(sum, vector); }
};
#elif GRAPHMATCH_NEON_DOT
// Unsigned bytes, four at a time (Armv8.2's dot product).
struct ByteArithmetic {
  static constexpr std::size_t kEntries = 4;
  static constexpr std::size_t kTileRows = 12;

  static std::uint32_t PackA(const std::uint8_t* entries) { return FourBytes(entries); }
  static std::uint32_t PackB(const std::uint8_t* entries) { return FourBytes(entries); }
  static HWY_INLINE Vector Start(Vector /*column_sums*/, std::size_t /*vector*/) {
    return hn::Zero(Tag());
  }
  static HWY_INLINE Vector MulAdd(Vector a, Vector b, Vector sum) {
#if defined(__ARM_FEATURE_DOTPROD)
    return Vector(vreinterpretq_s32_u32(vdotq_u32(
        vreinterpretq_u32_s32(sum.raw), vreinterpretq_u8_s32(a.raw), vreinterpretq_u8_s32(b.raw))));
#else
    asm(".arch armv8.2-a+dotprod+crypto\n\tudot %[sum].4s,%[a].16b,%[b].16b"
        : [sum] "+w"(sum.raw)
        : [a] "w"(a.raw), [b] "w"(b.raw));
    return sum;
#endif
  }
  static HWY_INLINE Vector Key(Vector sum, std::size_t vector) { return ToKey(sum, vector); }
};
#endif

#if HWY_TARGET > HWY_AVX3_DL && HWY_TARGET <= HWY_SSSE3
// Pairs of int16. There is room to have a scaled by 128, and the sum start from the index: the sums
// are the keys.
struct Int16Arithmetic {
  static constexpr std::size_t kEntries = 2;
  static constexpr std::size_t kTileRows = HWY_TARGET == HWY_AVX3 ? 12 : 6;

  static std::uint32_t PackA(const std::uint8_t* entries) { return PackB(entries) << kIndexBits; }
  static std::uint32_t PackB(const std::uint8_t* entries) {
    return entries[0] | static_cast<std::uint32_t>(entries[1]) << 16;
  }
  static HWY_INLINE Vector Start(Vector /*column_sums*/, std::size_t vector) {
    return IndexOfVector(vector);
  }
  static HWY_INLINE Vector MulAdd(Vector a, Vector b, Vector sum) {
    Vector products;
#if HWY_TARGET <= HWY_AVX2
    asm("vpmaddwd %[b],%[a],%[products]\n\t"
        "vpaddd %[products],%[sum],%[sum]"
        : [sum] "+v"(sum.raw), [products] "=&v"(products.raw)
        : [a] "v"(a.raw), [b] "v"(b.raw));
#else
    asm("movdqa %[a],%[products]\n\t"
        "pmaddwd %[b],%[products]\n\t"
        "paddd %[products],%[sum]"
        : [sum] "+x"(sum.raw), [products] "=&x"(products.raw)
        : [a] "x"(a.raw), [b] "x"(b.raw));
#endif
    return sum;
  }
  static HWY_INLINE Vector Key(Vector sum, std::size_t /*vector*/) { return sum; }
};
#elif HWY_TARGET > HWY_SSSE3
// Single precision, which is exact: every sum stays below 2^24.
struct FloatArithmetic {
  static constexpr std::size_t kEntries = 1;
  static constexpr std::size_t kTileRows = GRAPHMATCH_NEON ? 12 : 4;

  static std::uint32_t PackA(const std::uint8_t* entries) { return PackB(entries); }
  static std::uint32_t PackB(const std::uint8_t* entries) {
    const float value = *entries;
    std::uint32_t word = 0;
    std::memcpy(&word, &value, sizeof(word));
    return word;
  }
  static HWY_INLINE Vector Start(Vector /*column_sums*/, std::size_t /*vector*/) {
    return hn::Zero(Tag());
  }
  static HWY_INLINE Vector MulAdd(Vector a, Vector b, Vector sum) {
    const hn::RebindToFloat<Tag> floats;
    return hn::BitCast(Tag(), hn::MulAdd(hn::BitCast(floats, a), hn::BitCast(floats, b),
                                         hn::BitCast(floats, sum)));
  }
  static HWY_INLINE Vector Key(Vector sum, std::size_t vector) {
    return ToKey(hn::ConvertTo(Tag(), hn::BitCast(hn::RebindToFloat<Tag>(), sum)), vector);
  }
};
#endif

// Words of a descriptor.
template <class Arithmetic>
constexpr std::size_t kWords = kDim / Arithmetic::kEntries;

// A panel: the packed columns of one tile, after the sums of their entries.
HWY_INLINE std::size_t PanelColumns() { return kTileVectors * hn::Lanes(Tag()); }
template <class Arithmetic>
HWY_INLINE std::size_t PanelWords() {
  return (1 + kWords<Arithmetic>)*PanelColumns();
}

// Columns first .. first + num - 1 of b as panels. Columns that fill up the last one are zeros.
template <class Arithmetic>
void PackColumns(const DescriptorView& b, std::size_t first, std::size_t num,
                 std::uint32_t* packed) {
  const std::size_t width = PanelColumns();
  for (std::size_t column = 0; column < num; column += width, packed += PanelWords<Arithmetic>()) {
    const std::size_t num_here = std::min(width, num - column);
    if (num_here < width) std::fill_n(packed, PanelWords<Arithmetic>(), 0);
    for (std::size_t i = 0; i < num_here; ++i) {
      const std::uint8_t* entries = b.data + (first + column + i) * kDim;
      std::uint32_t sum = 0;
      for (std::size_t d = 0; d < kDim; ++d) sum += entries[d];
      packed[i] = sum;
      for (std::size_t k = 0; k < kWords<Arithmetic>; ++k) {
        packed[(1 + k) * width + i] = Arithmetic::PackB(entries + k * Arithmetic::kEntries);
      }
    }
  }
}

// Rows first .. first + Arithmetic::kTileRows - 1 of a; those beyond the end are zeros.
template <class Arithmetic>
void PackRows(const DescriptorView& a, std::size_t first, std::uint32_t* packed) {
  static constexpr std::array<std::uint8_t, kDim> kZeros = {};
  for (std::size_t row = 0; row < Arithmetic::kTileRows; ++row, packed += kWords<Arithmetic>) {
    const std::uint8_t* entries =
        first + row < a.num ? a.data + (first + row) * kDim : kZeros.data();
    for (std::size_t k = 0; k < kWords<Arithmetic>; ++k) {
      packed[k] = Arithmetic::PackA(entries + k * Arithmetic::kEntries);
    }
  }
}

// Enters a key into the greatest two of every lane.
HWY_INLINE void Enter(Vector key, Vector& best, Vector& second) {
  second = hn::Max(second, hn::Min(best, key));
  best = hn::Max(best, key);
}

// The products of a tile of rows with one panel, whose first vector is first_vector of the block,
// entered into the best two of every lane of the rows (Arithmetic::kTileRows x lanes) and of the
// columns.
//
// Its loops are unrolled by order: only with constant indices are the sums kept in registers.
template <class Arithmetic>
HWY_INLINE void Tile(const std::uint32_t* HWY_RESTRICT a, const std::uint32_t* HWY_RESTRICT panel,
                     std::size_t first_vector, std::int32_t* HWY_RESTRICT row_best,
                     std::int32_t* HWY_RESTRICT row_second, std::int32_t* HWY_RESTRICT column_best,
                     std::int32_t* HWY_RESTRICT column_second) {
  const Tag tag;
  const hn::RebindToUnsigned<Tag> words;
  const std::size_t lanes = hn::Lanes(tag);
  const auto load = [&](std::size_t row, std::size_t v) {
    return hn::BitCast(tag, hn::Load(words, panel + (row * kTileVectors + v) * lanes));
  };
  Vector sums[Arithmetic::kTileRows][kTileVectors];
#pragma GCC unroll 16
  for (std::size_t v = 0; v < kTileVectors; ++v) {
    const Vector start = Arithmetic::Start(load(0, v), first_vector + v);
#pragma GCC unroll 16
    for (std::size_t i = 0; i < Arithmetic::kTileRows; ++i) sums[i][v] = start;
  }
  for (std::size_t k = 0; k < kWords<Arithmetic>; ++k) {
    Vector b[kTileVectors];
#pragma GCC unroll 16
    for (std::size_t v = 0; v < kTileVectors; ++v) b[v] = load(1 + k, v);
#pragma GCC unroll 16
    for (std::size_t i = 0; i < Arithmetic::kTileRows; ++i) {
      const Vector word = hn::BitCast(tag, hn::Set(words, a[i * kWords<Arithmetic> + k]));
#pragma GCC unroll 16
      for (std::size_t v = 0; v < kTileVectors; ++v) {
        sums[i][v] = Arithmetic::MulAdd(word, b[v], sums[i][v]);
      }
    }
  }
  Vector column_bests[kTileVectors];
  Vector column_seconds[kTileVectors];
#pragma GCC unroll 16
  for (std::size_t v = 0; v < kTileVectors; ++v) {
    column_bests[v] = hn::Load(tag, column_best + v * lanes);
    column_seconds[v] = hn::Load(tag, column_second + v * lanes);
  }
#pragma GCC unroll 16
  for (std::size_t i = 0; i < Arithmetic::kTileRows; ++i) {
    Vector best = hn::Load(tag, row_best + i * lanes);
    Vector second = hn::Load(tag, row_second + i * lanes);
#pragma GCC unroll 16
    for (std::size_t v = 0; v < kTileVectors; ++v) {
      const Vector key = Arithmetic::Key(sums[i][v], first_vector + v);
      Enter(key, best, second);
      Enter(key, column_bests[v], column_seconds[v]);
    }
    hn::Store(best, tag, row_best + i * lanes);
    hn::Store(second, tag, row_second + i * lanes);
  }
#pragma GCC unroll 16
  for (std::size_t v = 0; v < kTileVectors; ++v) {
    hn::Store(column_bests[v], tag, column_best + v * lanes);
    hn::Store(column_seconds[v], tag, column_second + v * lanes);
  }
}

// The lanes of a row's keys in one block, entered into the row's result. Earlier blocks have the
// smaller columns, and win if equal.
HWY_INLINE void FinishRow(const std::int32_t* best_keys, const std::int32_t* second_keys,
                          std::size_t first_column, std::size_t row, TopTwo* result) {
  const Tag tag;
  const Vector best = hn::Load(tag, best_keys);
  const Vector second = hn::Load(tag, second_keys);
  const Vector greatest = hn::MaxOfLanes(tag, best);
  const std::intptr_t lane = hn::FindFirstTrue(tag, hn::Eq(best, greatest));
  const auto is_winner = hn::Eq(hn::Iota(tag, 0), hn::Set(tag, static_cast<std::int32_t>(lane)));
  const Vector others = hn::IfThenElse(is_winner, second, best);
  const std::int32_t best_key = hn::GetLane(greatest);
  const std::int32_t product = best_key >> kIndexBits;
  const std::int32_t runner_up = hn::GetLane(hn::MaxOfLanes(tag, others)) >> kIndexBits;
  if (product <= result->best_of_a[row]) {
    result->second_of_a[row] = std::max(result->second_of_a[row], product);
    return;
  }
  result->second_of_a[row] = std::max(result->best_of_a[row], runner_up);
  result->best_of_a[row] = product;
  const int mask = (1 << kIndexBits) - 1;
  const auto vector = static_cast<std::size_t>(mask - (best_key & mask));
  result->best_b[row] = static_cast<std::uint32_t>(first_column + vector * hn::Lanes(tag) +
                                                   static_cast<std::size_t>(lane));
}

// A pointer into values, from where on it has room for num of them, that vectors may be loaded
// from.
template <typename T>
T* Aligned(std::vector<T>* values, std::size_t num) {
  constexpr std::size_t kAlignment = 64;
  values->resize(std::max(values->size(), num + kAlignment / sizeof(T)));
  const auto address = reinterpret_cast<std::uintptr_t>(values->data());
  return values->data() + (kAlignment - address % kAlignment) % kAlignment / sizeof(T);
}

template <class Arithmetic>
void ComputeWith(const DescriptorView& a, const DescriptorView& b, TopTwoBuffers* buffers,
                 TopTwo* result) {
  constexpr std::size_t kTileRows = Arithmetic::kTileRows;
  const std::size_t lanes = hn::Lanes(Tag());
  const std::size_t block_columns = kBlockVectors * lanes;
  std::uint32_t* packed_b =
      Aligned(&buffers->packed_b, kBlockVectors / kTileVectors * PanelWords<Arithmetic>());
  std::uint32_t* packed_a = Aligned(&buffers->packed_a, kTileRows * kWords<Arithmetic>);
  std::int32_t* row_best = Aligned(&buffers->row_keys, 2 * kTileRows * lanes);
  std::int32_t* row_second = row_best + kTileRows * lanes;
  std::int32_t* column_best = Aligned(&buffers->column_keys, 2 * block_columns);
  std::int32_t* column_second = column_best + block_columns;

  for (std::size_t first = 0; first < b.num; first += block_columns) {
    const std::size_t num = std::min(block_columns, b.num - first);
    PackColumns<Arithmetic>(b, first, num, packed_b);
    std::fill_n(column_best, 2 * block_columns, 0);
    for (std::size_t row = 0; row < a.num; row += kTileRows) {
      PackRows<Arithmetic>(a, row, packed_a);
      std::fill_n(row_best, 2 * kTileRows * lanes, 0);
      const std::uint32_t* panel = packed_b;
      for (std::size_t column = 0; column < num; column += PanelColumns()) {
        Tile<Arithmetic>(packed_a, panel, column / lanes, row_best, row_second,
                         column_best + column, column_second + column);
        panel += PanelWords<Arithmetic>();
      }
      for (std::size_t i = 0; i < std::min(kTileRows, a.num - row); ++i) {
        FinishRow(row_best + i * lanes, row_second + i * lanes, first, row + i, result);
      }
    }
    for (std::size_t column = 0; column < num; ++column) {
      result->best_of_b[first + column] = column_best[column] >> kIndexBits;
      result->second_of_b[first + column] = column_second[column] >> kIndexBits;
    }
  }
}

void ComputeTopTwoOnTarget(const DescriptorView& a, const DescriptorView& b, bool dot_products,
                           TopTwoBuffers* buffers, TopTwo* result) {
#if HWY_TARGET == HWY_AVX2 || GRAPHMATCH_NEON_DOT
  if (dot_products) return ComputeWith<ByteArithmetic>(a, b, buffers, result);
#else
  static_cast<void>(dot_products);  // They are part of the target, or there are none.
#endif
#if HWY_TARGET <= HWY_AVX3_DL
  ComputeWith<ByteArithmetic>(a, b, buffers, result);
#elif HWY_TARGET <= HWY_SSSE3
  ComputeWith<Int16Arithmetic>(a, b, buffers, result);
#else
  ComputeWith<FloatArithmetic>(a, b, buffers, result);
#endif
}

// The target, and whether it is one that dot products of bytes add to.
const char* TargetName(bool dot_products) {
#if HWY_TARGET <= HWY_AVX3_DL
  static_cast<void>(dot_products);
  return "AVX-512 with VNNI";
#elif HWY_TARGET == HWY_AVX3
  static_cast<void>(dot_products);
  return "AVX-512";
#else
#if HWY_TARGET == HWY_AVX2
  if (dot_products) return "AVX2 with VNNI";
#elif GRAPHMATCH_NEON_DOT
  if (dot_products) return "NEON with dot products";
#endif
  static_cast<void>(dot_products);
  return hwy::TargetName(HWY_TARGET);
#endif
}

}  // namespace HWY_NAMESPACE
}  // namespace colmap_graphmatch
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#if HWY_ARCH_ARM_A64
#include <sys/auxv.h>
#elif HWY_ARCH_X86
#include <cpuid.h>
#endif

namespace colmap_graphmatch {
namespace {

// Instructions that Highway 1.0 does not ask the processor about: AVX-VNNI, or Armv8.2's udot.
bool DetectDotProducts() {
#if HWY_ARCH_X86
  constexpr unsigned kAvxVnni = 1U << 4;
  unsigned eax = 0;
  unsigned ebx = 0;
  unsigned ecx = 0;
  unsigned edx = 0;
  return __get_cpuid_count(7, 1, &eax, &ebx, &ecx, &edx) != 0 && (eax & kAvxVnni) != 0;
#elif HWY_ARCH_ARM_A64
  constexpr unsigned long kAsimdDp = 1UL << 20;
  return (::getauxval(AT_HWCAP) & kAsimdDp) != 0;
#else
  return false;
#endif
}

std::atomic<bool> dot_products_allowed{true};

bool UseDotProducts() {
  static const bool detected = DetectDotProducts();
  return detected && dot_products_allowed;
}

}  // namespace

HWY_EXPORT(ComputeTopTwoOnTarget);
HWY_EXPORT(TargetName);

void ComputeTopTwo(const DescriptorView& a, const DescriptorView& b, TopTwoBuffers* buffers,
                   TopTwo* result) {
  result->best_of_a.assign(a.num, 0);
  result->second_of_a.assign(a.num, 0);
  result->best_b.assign(a.num, 0);
  result->best_of_b.assign(b.num, 0);
  result->second_of_b.assign(b.num, 0);
  HWY_DYNAMIC_DISPATCH(ComputeTopTwoOnTarget)(a, b, UseDotProducts(), buffers, result);
}

const char* TopTwoTarget() { return HWY_DYNAMIC_DISPATCH(TargetName)(UseDotProducts()); }

void AllowDotProductsForTest(bool allowed) { dot_products_allowed = allowed; }

}  // namespace colmap_graphmatch
#endif

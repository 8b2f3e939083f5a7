#include "scripts/photo_renderer/jpeg_writer.h"

// jpeglib.h needs FILE and size_t to be declared before it.
#include <cstdio>
// clang-format off
#include <jpeglib.h>
// clang-format on

#include <cstdlib>
#include <fstream>
#include <stdexcept>

namespace colmap_graphmatch::synthetic {

void WriteJpeg(const std::string& path, int width, int height, int quality,
               const std::vector<uint8_t>& rgb) {
  // Compressing to memory leaves all errors of the file system to the stream below; libjpeg itself
  // would end the process.
  jpeg_compress_struct compress;
  jpeg_error_mgr errors;
  compress.err = jpeg_std_error(&errors);
  jpeg_create_compress(&compress);
  unsigned char* bytes = nullptr;
  unsigned long num_bytes = 0;  // NOLINT(runtime/int): the type that libjpeg asks for.
  jpeg_mem_dest(&compress, &bytes, &num_bytes);

  compress.image_width = static_cast<JDIMENSION>(width);
  compress.image_height = static_cast<JDIMENSION>(height);
  compress.input_components = 3;
  compress.in_color_space = JCS_RGB;
  jpeg_set_defaults(&compress);
  jpeg_set_quality(&compress, quality, TRUE);
  jpeg_start_compress(&compress, TRUE);
  const size_t stride = 3 * static_cast<size_t>(width);
  while (compress.next_scanline < compress.image_height) {
    JSAMPROW row = const_cast<JSAMPROW>(rgb.data() + stride * compress.next_scanline);
    jpeg_write_scanlines(&compress, &row, 1);
  }
  jpeg_finish_compress(&compress);
  jpeg_destroy_compress(&compress);

  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes), static_cast<std::streamsize>(num_bytes));
  std::free(bytes);
  file.close();
  if (!file) throw std::runtime_error("cannot write " + path);
}

}  // namespace colmap_graphmatch::synthetic

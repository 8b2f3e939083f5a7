// GDAL without its formats. OpenCV is linked against GDAL and with it against a hundred libraries,
// which take four fifths of the time that graphmatch_matcher needs to start (0.2 s). No test reads
// a photo by GDAL: those that start the program hundreds of times find this in its place.

enum GDALRWFlag {};
enum GDALDataType {};
struct GDALRasterIOExtraArg;

extern "C" {
void GDALAllRegister() {}
void* GDALOpen(const char*, int) { return nullptr; }  // It knows no such file.
void GDALClose(void*) {}
const char* GDALGetDataTypeName(int) { return ""; }
}

// OpenCV calls these for what GDALOpen returned.
class GDALDataset {
 public:
  void* GetRasterBand(int);
  int GetRasterCount();
  int GetRasterXSize();
  int GetRasterYSize();
};
void* GDALDataset::GetRasterBand(int) { return nullptr; }
int GDALDataset::GetRasterCount() { return 0; }
int GDALDataset::GetRasterXSize() { return 0; }
int GDALDataset::GetRasterYSize() { return 0; }

class GDALRasterBand {
 public:
  int GetRasterDataType();
  int GetXSize();
  int GetYSize();
  int RasterIO(GDALRWFlag, int, int, int, int, void*, int, int, GDALDataType, long long, long long,
               GDALRasterIOExtraArg*);
};
int GDALRasterBand::GetRasterDataType() { return 0; }
int GDALRasterBand::GetXSize() { return 0; }
int GDALRasterBand::GetYSize() { return 0; }
int GDALRasterBand::RasterIO(GDALRWFlag, int, int, int, int, void*, int, int, GDALDataType,
                             long long, long long, GDALRasterIOExtraArg*) {
  return 0;
}

class GDALColorTable {
 public:
  const void* GetColorEntry(int) const;
  int GetPaletteInterpretation() const;
};
const void* GDALColorTable::GetColorEntry(int) const { return nullptr; }
int GDALColorTable::GetPaletteInterpretation() const { return 0; }

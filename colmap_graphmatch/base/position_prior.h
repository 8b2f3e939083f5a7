#pragma once

#include <array>
#include <cstdint>

namespace colmap_graphmatch {

// Where an image was taken, as far as its database knows before any reconstruction. Coordinates
// may be any numbers, NaN and infinite ones too.
struct PositionPrior {
  enum class System : std::uint8_t {
    kGeographic,  // Latitude and longitude in degrees, altitude in metres (WGS84).
    kCartesian,   // In a unit that is the same for all images.
  };
  System system = System::kGeographic;
  std::array<double, 3> position = {0, 0, 0};
  double accuracy = 0;  // The greatest standard deviation, in metres or that unit; 0: not known.
};

}  // namespace colmap_graphmatch

#pragma once

#include <cstdint>

#include "scripts/photo_renderer/scene.h"

namespace colmap_graphmatch::synthetic {

// Three monuments on their own patches of ground, each about the origin and within some 10 units of
// it, with its front towards the x axis. They differ in shape and colours, and share no texture;
// neither do different seeds.
Scene BuildMonument(int index, uint32_t seed);

}  // namespace colmap_graphmatch::synthetic

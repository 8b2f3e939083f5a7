#pragma once

#include <functional>
#include <string>

namespace colmap_graphmatch {

// Where what a run has to say goes, a sentence or more each. Both must be set.
struct Messages {
  std::function<void(const std::string& message)> info;
  std::function<void(const std::string& warning)> warn;
};

}  // namespace colmap_graphmatch

#pragma once

#include <stdexcept>
#include <string>

// What can go wrong for a reason that the caller has to know. Every message says what happened, to
// which file, image or pair, and how to mend it. Pairs that do not verify and images without
// features are data, never exceptions.

namespace colmap_graphmatch {

class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// An option has a value that it cannot have, or two options contradict each other.
class OptionsError : public Error {
 public:
  using Error::Error;
};

// The database is missing, is not COLMAP's, cannot be read or written, or contains what it must
// not.
class DatabaseError : public Error {
 public:
  using Error::Error;
};

// Another process kept the database locked for longer than the stated time.
class DatabaseLockedError : public DatabaseError {
 public:
  using DatabaseError::DatabaseError;
};

// COLMAP is missing, too old, or fails on everything it is given.
class ColmapError : public Error {
 public:
  using Error::Error;
};

// The run was asked to stop before it had anything to return (see base/stop_request.h).
class StoppedError : public Error {
 public:
  StoppedError() : Error("The run was stopped.") {}
};

// The system lets this program start no more threads or processes, or open no more files.
class SystemLimitError : public Error {
 public:
  using Error::Error;
};

// The working directory, or any other file that is not a database, cannot be written or read.
class FileError : public Error {
 public:
  using Error::Error;
};

}  // namespace colmap_graphmatch

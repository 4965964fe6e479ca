// What writers of HDF5 files share. Internal to data/.
#pragma once

#include <hdf5.h>

namespace mbv::internal {

/// One of HDF5's numbers, and how it is given back; negative: there is none.
class Hdf5Handle {
 public:
  Hdf5Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Hdf5Handle() {
    if (id_ >= 0) close_(id_);
  }
  Hdf5Handle(const Hdf5Handle&) = delete;
  Hdf5Handle& operator=(const Hdf5Handle&) = delete;

  [[nodiscard]] hid_t id() const { return id_; }
  [[nodiscard]] bool good() const { return id_ >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// Properties without the times at which things are made: the same values give the same bytes.
[[nodiscard]] inline Hdf5Handle Undated(hid_t kind) {
  const hid_t list = H5Pcreate(kind);
  H5Pset_obj_track_times(list, false);
  return {list, &H5Pclose};
}

}  // namespace mbv::internal

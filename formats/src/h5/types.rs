//! Types of HDF5 as the library sees them, before they are described: damaged ones may claim tens of thousands of members.

use hdf5::Dataset;
use hdf5_sys::h5i::hid_t;
use hdf5_sys::h5t::{H5T_class_t, H5Tclose, H5Tget_class, H5Tget_member_type, H5Tget_nmembers};

/// Types inside types that are looked into.
const DEEPEST: usize = 4;

/// Members of the type of a dataset: fields of a compound with those of their types, values of an enumeration.
pub(super) fn members(dataset: &Dataset) -> usize {
    dataset.dtype().map_or(0, |t| of(t.id(), 0))
}

fn of(id: hid_t, depth: usize) -> usize {
    // SAFETY: the identifier is that of an open type, and the members' types are closed again; the lock of the library is held.
    let (class, n) = hdf5::sync::sync(|| unsafe { (H5Tget_class(id), H5Tget_nmembers(id)) });
    let n = usize::try_from(n).unwrap_or(0);
    // The fields of a type with too many need not be counted.
    if class != H5T_class_t::H5T_COMPOUND || depth >= DEEPEST || n > 1024 {
        return n;
    }
    (0..n as u32).fold(n, |sum, k| {
        // SAFETY: as above.
        let inner = hdf5::sync::sync(|| unsafe { H5Tget_member_type(id, k) });
        if inner < 0 {
            return sum;
        }
        let total = sum.saturating_add(of(inner, depth + 1));
        // SAFETY: as above.
        hdf5::sync::sync(|| unsafe { H5Tclose(inner) });
        total
    })
}

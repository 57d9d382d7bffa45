//! Checks of HDF5 datasets and their types before they are used. A damaged type may claim tens of thousands of members, members outside their compound, numbers
//! with more bits than their bytes hold, or enumerations of numbers of a megabyte each. Version 1.10 of the library then reads beyond its
//! buffers.

use hdf5::Dataset;
use hdf5::plist::dataset_create::Layout;
use hdf5_sys::h5i::hid_t;
use hdf5_sys::h5t::{
    H5T_class_t, H5Tclose, H5Tget_class, H5Tget_fields, H5Tget_member_offset, H5Tget_member_type, H5Tget_nmembers, H5Tget_offset,
    H5Tget_precision, H5Tget_size, H5Tget_super,
};

/// Largest depth of nested types.
const DEEPEST: usize = 4;
/// Largest size of a number, bytes.
const WIDEST: usize = 16;
/// Largest number of members of a type, including the members of its members. The library compares types in a time that grows with the
/// square of this number.
const MOST_MEMBERS: usize = 1024;

/// The flaw of a dataset, as an index into [`FLAWS`].
pub(super) fn flaw(dataset: &Dataset) -> Option<usize> {
    if is_elsewhere(dataset) {
        return Some(ELSEWHERE);
    }
    dataset.dtype().ok().and_then(|t| of(t.id(), 0, &mut 0).err())
}

/// True where the values of a dataset are in another file: external storage, or a virtual dataset. That file could be any file that the user
/// may read, or a pipe that never answers, so it is never opened.
pub(super) fn is_elsewhere(dataset: &Dataset) -> bool {
    dataset.dcpl().is_ok_and(|p| !p.external().is_empty() || p.get_layout().is_ok_and(|l| l == Layout::Virtual))
}

/// Flaw of a dataset whose values are in another file, and of a link to another file.
const ELSEWHERE: usize = 4;
pub(super) const LINK_ELSEWHERE: usize = 5;

/// Flaws of datasets and links.
pub(super) const FLAWS: [&str; 6] = [
    "a type of more than 1024 members",
    "a type with a member that lies outside of it",
    "a number with more bits than its bytes hold",
    "a number of more than 16 bytes",
    "a dataset whose values are in another file, which is not opened (copy them into this file first, as with h5repack)",
    "a link to another file, which is not opened (copy what it leads to into this file first)",
];

/// Check a type and the types of its members; `seen` counts the members.
fn of(id: hid_t, depth: usize, seen: &mut usize) -> Result<(), usize> {
    // SAFETY: the identifier is that of an open type; the lock of the library is held.
    let (class, size, n) = hdf5::sync::sync(|| unsafe { (H5Tget_class(id), H5Tget_size(id), H5Tget_nmembers(id)) });
    if matches!(class, H5T_class_t::H5T_INTEGER | H5T_class_t::H5T_FLOAT) {
        if size > WIDEST {
            return Err(3);
        }
        return if bits_fit(id, size, class == H5T_class_t::H5T_FLOAT) { Ok(()) } else { Err(2) };
    }
    let n = usize::try_from(n).unwrap_or(0);
    *seen = seen.saturating_add(n);
    if *seen > MOST_MEMBERS {
        return Err(0);
    }
    if depth >= DEEPEST {
        return Ok(());
    }
    if matches!(class, H5T_class_t::H5T_ENUM | H5T_class_t::H5T_ARRAY | H5T_class_t::H5T_VLEN) {
        // SAFETY: as above; the type behind is closed below.
        let behind = hdf5::sync::sync(|| unsafe { H5Tget_super(id) });
        let result = if behind < 0 { Ok(()) } else { of(behind, depth + 1, seen) };
        // SAFETY: as above.
        hdf5::sync::sync(|| unsafe { H5Tclose(behind) });
        return result;
    }
    if class != H5T_class_t::H5T_COMPOUND {
        return Ok(());
    }
    for k in 0..n as u32 {
        // SAFETY: as above; the member's type is closed below.
        let (inner, offset) = hdf5::sync::sync(|| unsafe { (H5Tget_member_type(id, k), H5Tget_member_offset(id, k)) });
        if inner < 0 {
            continue;
        }
        // SAFETY: as above.
        let length = hdf5::sync::sync(|| unsafe { H5Tget_size(inner) });
        let inside = offset.checked_add(length).is_some_and(|end| end <= size);
        let result = if inside { of(inner, depth + 1, seen) } else { Err(1) };
        // SAFETY: as above.
        hdf5::sync::sync(|| unsafe { H5Tclose(inner) });
        result?;
    }
    Ok(())
}

/// True where the bits of a number, and of its exponent and mantissa, lie within its bytes.
fn bits_fit(id: hid_t, size: usize, float: bool) -> bool {
    let within = |first: usize, count: usize, all: usize| first.checked_add(count).is_some_and(|end| end <= all);
    // SAFETY: the identifier is that of an open type, the numbers outlive the call; the lock of the library is held.
    let (offset, precision, fields) = hdf5::sync::sync(|| unsafe {
        let mut f = [0_usize; 5];
        let [sign, exponent, exponents, mantissa, mantissas] = &mut f;
        if float {
            H5Tget_fields(id, sign, exponent, exponents, mantissa, mantissas);
        }
        (H5Tget_offset(id), H5Tget_precision(id), f)
    });
    let [sign, exponent, exponents, mantissa, mantissas] = fields;
    let bits = size.saturating_mul(8);
    usize::try_from(offset).is_ok_and(|o| within(o, precision, bits))
        && (!float || within(sign, 1, bits) && within(exponent, exponents, bits) && within(mantissa, mantissas, bits))
}

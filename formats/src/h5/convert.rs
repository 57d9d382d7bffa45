//! Conversion of values from the type of the file to the requested type, by the library.

use bytemuck::{Pod, cast_slice_mut, zeroed_vec};
use hdf5::{Dataset, Datatype, H5Type};
use hdf5_sys::h5p::H5P_DEFAULT;
use hdf5_sys::h5t::{H5T_class_t, H5Tclose, H5Tconvert, H5Tequal, H5Tget_class, H5Tget_super};
use num_complex::Complex;

/// Number of elements that are converted at once.
const AT_ONCE: usize = 1 << 16;

/// The form in which values are written into a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// As the bytes in the file.
    Stored,
    /// Doubles, alone or in pairs, as floats.
    Floats,
}

/// `n` values of a dataset. `fill` writes them, in the form that it is given, into its buffer.
pub(super) fn values<T: H5Type + Pod>(
    dataset: &Dataset,
    n: usize,
    fill: impl FnOnce(&mut [u8], Form) -> hdf5::Result<()>,
) -> hdf5::Result<Vec<T>> {
    let (from, to) = (dataset.dtype()?, Datatype::from_type::<T>()?);
    let mut out: Vec<T> = zeroed_vec(n);
    if let Some(form) = form(&from, &to)? {
        fill(cast_slice_mut(&mut out), form)?;
        return Ok(out);
    }
    if from.conv_path(&to).is_none() {
        return Err("values of a type that cannot be converted".into());
    }
    let size = from.size();
    let mut bytes: Vec<u8> = zeroed_vec(n.checked_mul(size).ok_or("more values than memory holds")?);
    fill(&mut bytes, Form::Stored)?;
    let width = size.max(size_of::<T>());
    // The background buffer for the members of compounds, which the library uses where it needs it.
    let (mut work, mut ground) = (vec![0_u8; width * AT_ONCE.min(n)], vec![0_u8; width * AT_ONCE.min(n)]);
    for (part, to_part) in bytes.chunks(size.max(1) * AT_ONCE).zip(out.chunks_mut(AT_ONCE)) {
        work[..part.len()].copy_from_slice(part);
        // SAFETY: both buffers hold as many elements of the wider type; the lock of the library is held.
        let status = hdf5::sync::sync(|| unsafe {
            H5Tconvert(from.id(), to.id(), to_part.len(), work.as_mut_ptr().cast(), ground.as_mut_ptr().cast(), H5P_DEFAULT)
        });
        if status < 0 {
            return Err("values that cannot be converted".into());
        }
        let to_part: &mut [u8] = cast_slice_mut(to_part);
        to_part.copy_from_slice(&work[..to_part.len()]);
    }
    Ok(out)
}

/// The form in which values of a dataset are written as `T`; `None` where the library must convert them.
pub(super) fn form_as<T: H5Type>(dataset: &Dataset) -> hdf5::Result<Option<Form>> {
    form(&dataset.dtype()?, &Datatype::from_type::<T>()?)
}

fn form(from: &Datatype, to: &Datatype) -> hdf5::Result<Option<Form>> {
    if alike(from, to) {
        return Ok(Some(Form::Stored));
    }
    Ok(doubles_as_floats(from, to)?.then_some(Form::Floats))
}

/// True for doubles that become floats, alone or as complex numbers. The library takes much longer for them than the file system.
fn doubles_as_floats(from: &Datatype, to: &Datatype) -> hdf5::Result<bool> {
    let are = |a: Datatype, b: Datatype| *from == a && *to == b;
    Ok(are(Datatype::from_type::<f64>()?, Datatype::from_type::<f32>()?)
        || are(Datatype::from_type::<Complex<f64>>()?, Datatype::from_type::<Complex<f32>>()?))
}

/// True where elements of the two types have the same bytes: equal types, or an enumeration of such numbers (h5py's booleans).
fn alike(from: &Datatype, to: &Datatype) -> bool {
    from == to
        || hdf5::sync::sync(|| {
            // SAFETY: the identifiers are those of open types, and the new one is closed; the lock of the library is held.
            unsafe {
                if H5Tget_class(from.id()) != H5T_class_t::H5T_ENUM {
                    return false;
                }
                let numbers = H5Tget_super(from.id());
                let equal = numbers >= 0 && H5Tequal(numbers, to.id()) > 0;
                H5Tclose(numbers);
                equal
            }
        })
}

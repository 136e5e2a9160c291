//! What a host's pointers point to, checked as far as can be.

use super::status::{Failure, HRR_ERROR_ABI, Outcome};
use std::ffi::{CStr, c_char, c_void};
use std::sync::Arc;

/// A function of the host's and what it is called with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Callback<F> {
    pub function: F,
    pub user: *mut c_void,
}

// SAFETY: the pointer is only ever handed to the host's function, which hosts make callable from any thread.
unsafe impl<F: Send> Send for Callback<F> {}
// SAFETY: as above.
unsafe impl<F: Sync> Sync for Callback<F> {}

impl<F> Callback<F> {
    pub fn new(function: Option<F>, user: *mut c_void) -> Option<Self> {
        function.map(|function| Self { function, user })
    }
}

/// A text of the host's, in UTF-8.
pub(super) unsafe fn text<'a>(pointer: *const c_char, name: &str) -> Outcome<&'a str> {
    if pointer.is_null() {
        return Err(is_null(name));
    }
    // SAFETY: not NULL; the caller vouches that it ends with a zero.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map_err(|_| Failure::argument(format!("{name} is not UTF-8: {text:?}")))
}

/// A handle's object, kept alive by the host.
#[inline(always)]
pub(super) unsafe fn object<'a, T>(handle: *const T, name: &str) -> Outcome<&'a T> {
    aligned(handle, name)?;
    // SAFETY: not NULL and aligned; the caller vouches that it is a live handle.
    Ok(unsafe { &*handle })
}

/// A handle for an object, with one reference.
pub(super) fn handle<T>(object: T) -> *mut T {
    Arc::into_raw(Arc::new(object)).cast_mut()
}

/// One more reference; NULL is left alone.
pub(super) unsafe fn retain<T>(handle: *const T) {
    if !handle.is_null() {
        // SAFETY: the caller vouches that it came from `handle` and that a reference is left.
        unsafe { Arc::increment_strong_count(handle) };
    }
}

/// One reference less; NULL is left alone.
pub(super) unsafe fn release<T>(handle: *const T) {
    if !handle.is_null() {
        // SAFETY: as in `retain`; the reference is the caller's to give up.
        drop(unsafe { Arc::from_raw(handle) });
    }
}

#[cold]
fn is_null(name: &str) -> Failure {
    Failure::argument(format!("{name} is NULL"))
}

#[cold]
fn is_not_aligned(name: &str) -> Failure {
    Failure::argument(format!("{name} is not aligned"))
}

#[inline(always)]
fn aligned<T>(pointer: *const T, name: &str) -> Outcome {
    if pointer.is_null() {
        return Err(is_null(name));
    }
    if !pointer.is_aligned() {
        return Err(is_not_aligned(name));
    }
    Ok(())
}

/// A place that a result goes to, not yet written.
#[derive(Debug)]
pub(super) struct Out<T>(*mut T);

impl<T> Out<T> {
    /// Checks the pointer that a result will be written to.
    #[inline(always)]
    pub unsafe fn new(pointer: *mut T, name: &str) -> Outcome<Self> {
        aligned(pointer.cast_const(), name)?;
        Ok(Self(pointer))
    }

    /// As [`Out::new`], for `count` results; NULL is fine when there are none.
    pub unsafe fn array(pointer: *mut T, count: usize, name: &str) -> Outcome<Self> {
        if count > 0 {
            aligned(pointer.cast_const(), name)?;
        }
        Ok(Self(pointer))
    }

    /// As [`Out::new`], for a result that the host may not want.
    pub unsafe fn optional(pointer: *mut T, name: &str) -> Outcome<Option<Self>> {
        // SAFETY: passed on.
        if pointer.is_null() { Ok(None) } else { unsafe { Self::new(pointer, name) }.map(Some) }
    }

    pub fn write(&self, value: T) {
        // SAFETY: checked when made; the caller of `new` vouches for room.
        unsafe { self.0.write(value) };
    }

    /// Writes the `index`-th of an array.
    pub unsafe fn write_at(&self, index: usize, value: T) {
        // SAFETY: the caller vouches that the array is longer than `index`.
        unsafe { self.0.add(index).write(value) };
    }
}

impl<T: Copy> Out<T> {
    /// What is there already.
    pub fn read(&self) -> T {
        // SAFETY: checked when made; the caller vouches that it is initialised.
        unsafe { self.0.read() }
    }
}

/// A pointer that is not NULL.
#[inline(always)]
pub(super) fn given<T>(pointer: *const T, name: &str) -> Outcome<*const T> {
    if pointer.is_null() { Err(is_null(name)) } else { Ok(pointer) }
}

/// A copy of one thing, which need not be aligned.
pub(super) unsafe fn copy<T: Copy>(pointer: *const T, name: &str) -> Outcome<T> {
    given(pointer, name)?;
    // SAFETY: not NULL; the caller vouches for the rest.
    Ok(unsafe { pointer.read_unaligned() })
}

/// Three finite numbers.
pub(super) unsafe fn vector(pointer: *const f64, name: &str) -> Outcome<glam::DVec3> {
    // SAFETY: passed on.
    let v = glam::DVec3::from_array(unsafe { copy(pointer.cast::<[f64; 3]>(), name) }?);
    if v.is_finite() { Ok(v) } else { Err(Failure::non_finite(format!("{name} is {v}"))) }
}

/// Largest `struct_size` that can be meant.
const MAX_STRUCT: u32 = 4096;

/// Checks the `struct_size` that a struct of `T` begins with, and gives it.
pub(super) unsafe fn struct_size<T>(pointer: *const T, name: &str) -> Outcome<usize> {
    // SAFETY: every sized struct begins with it.
    let size = unsafe { copy(pointer.cast::<u32>(), name) }?;
    let own = size_of::<T>();
    if size > MAX_STRUCT || (size as usize) < own {
        let message = format!("{name}->struct_size is {size}: set it to sizeof({name}'s type), {own} here");
        return Err(Failure::new(HRR_ERROR_ABI, message));
    }
    Ok(size as usize)
}

/// The place of a result that begins with its size, and that size.
pub(super) unsafe fn sized_out<T>(pointer: *mut T, name: &str) -> Outcome<(Out<T>, u32)> {
    // SAFETY: passed on; the size is read after the pointer was found to be good.
    unsafe {
        let out = Out::new(pointer, name)?;
        Ok((out, struct_size(pointer, name)? as u32))
    }
}

/// A copy of a struct that begins with its size. One from a newer header must ask for nothing new.
pub(super) unsafe fn sized<T: Copy>(pointer: *const T, name: &str) -> Outcome<T> {
    // SAFETY: passed on.
    let size = unsafe { struct_size(pointer, name) }?;
    for byte in size_of::<T>()..size {
        // SAFETY: the struct is `size` bytes long, says its owner.
        if unsafe { pointer.cast::<u8>().add(byte).read() } != 0 {
            let message = format!("{name} sets a field (byte {byte}) that this library does not know");
            return Err(Failure::new(HRR_ERROR_ABI, message));
        }
    }
    // SAFETY: as long as `T` or longer.
    unsafe { copy(pointer, name) }
}

/// Things at equal distances in a host's memory, aligned or not.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strided<T> {
    first: *const T,
    stride: usize,
}

// SAFETY: read only; hosts let all threads of a call read their arrays.
unsafe impl<T> Send for Strided<T> {}
// SAFETY: as above.
unsafe impl<T> Sync for Strided<T> {}

impl<T: Copy> Strided<T> {
    /// `count` things `stride` bytes apart (0: packed). NULL is an error when there are any.
    pub unsafe fn new(first: *const T, stride: usize, count: usize, name: &str) -> Outcome<Self> {
        let stride = if stride == 0 { size_of::<T>() } else { stride };
        if count > 0 && first.is_null() {
            return Err(Failure::argument(format!("{name} is NULL, for {count} elements")));
        }
        if stride < size_of::<T>() {
            let message = format!("{name}: a stride of {stride} bytes, elements of {}", size_of::<T>());
            return Err(Failure::argument(message));
        }
        if stride.checked_mul(count).is_none_or(|bytes| bytes > isize::MAX as usize) {
            return Err(Failure::argument(format!("{name}: {count} elements {stride} bytes apart")));
        }
        Ok(Self { first, stride })
    }

    /// Where the `index`-th lies.
    pub unsafe fn at(&self, index: usize) -> *const T {
        // SAFETY: the caller vouches that `index` is below the count.
        unsafe { self.first.byte_add(index * self.stride) }
    }

    /// The `index`-th.
    pub unsafe fn get(&self, index: usize) -> T {
        // SAFETY: the caller vouches that `index` is below the count, and for what is there.
        unsafe { self.at(index).read_unaligned() }
    }
}

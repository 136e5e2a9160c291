//! Values out of any bytes, for the fuzzer and the test suite.

/// Takes values off the front; zeros when there is no more.
pub struct Bytes<'a>(pub &'a [u8]);

impl Bytes<'_> {
    pub fn take<const N: usize>(&mut self) -> [u8; N] {
        let (head, rest) = self.0.split_at(N.min(self.0.len()));
        self.0 = rest;
        let mut out = [0; N];
        out[..head.len()].copy_from_slice(head);
        out
    }

    pub fn byte(&mut self) -> u8 {
        self.take::<1>()[0]
    }
}

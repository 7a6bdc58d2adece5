//! The text of the project's own files: RON.

/// The extensions of RON that all of them may use: `Some(x)` may be written `x`, and what wraps one
/// value is left out.
pub fn options() -> ron::Options {
    use ron::extensions::Extensions;
    ron::Options::default().with_default_extension(
        Extensions::IMPLICIT_SOME
            | Extensions::UNWRAP_NEWTYPES
            | Extensions::UNWRAP_VARIANT_NEWTYPES,
    )
}

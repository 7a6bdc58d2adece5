//! Accessors: checked first, then read value by value.

use ::gltf::json::accessor::{Accessor, ComponentType, Type};
use ::gltf::json::validation::Checked;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::super::reader::Reader;
use super::buffers::Buffers;
use super::parse::File;
use crate::error::{Error, Result};

/// What the values of an accessor may be where it is used.
pub(super) struct Kind<'a> {
    pub(super) shapes: &'a [Type],
    pub(super) components: &'a [ComponentType],
}

/// The values of an accessor, all of them within its buffers.
pub(super) struct Values {
    /// How many there are; 1 or more.
    pub(super) count: usize,
    /// The numbers that each has.
    pub(super) components: usize,
    kind: ComponentType,
    normalized: bool,
    run: Option<Run>,
    /// Values that replace others, and where by the number of the one that each replaces.
    sparse: Option<(Run, HashMap<usize, usize>)>,
}

/// Elements in a buffer, one after the other.
struct Run {
    data: Arc<Vec<u8>>,
    start: usize,
    stride: usize,
}

impl Run {
    fn at(&self, i: usize, offset: usize) -> &[u8] {
        self.data.get(self.start + i * self.stride + offset..).unwrap_or_default()
    }
}

impl Values {
    /// The values of an accessor.
    ///
    /// # Errors
    /// If it is not of a kind that fits its use, or reaches beyond its buffers.
    pub(super) fn new(
        reader: &mut Reader,
        file: &File,
        buffers: &mut Buffers,
        index: usize,
        kind: &Kind<'_>,
    ) -> Result<Values> {
        let accessor = file.root.accessors.get(index);
        let accessor =
            accessor.ok_or_else(|| Error::invalid(format!("there is no accessor {index}")))?;
        let values = Values::of(reader, file, buffers, accessor, kind);
        values.map_err(|error| match error.path() {
            Some(_) => error,
            None => Error::invalid(format!("accessor {index} {error}")),
        })
    }

    fn of(
        reader: &mut Reader,
        file: &File,
        buffers: &mut Buffers,
        accessor: &Accessor,
        kind: &Kind<'_>,
    ) -> Result<Values> {
        let (Checked::Valid(component), Checked::Valid(shape)) =
            (&accessor.component_type, &accessor.type_)
        else {
            return Err(Error::invalid("is of no known type"));
        };
        let component = component.0;
        if !kind.shapes.contains(shape) || !kind.components.contains(&component) {
            let message = format!("is {shape:?} of {component:?}, which does not fit its use");
            return Err(Error::invalid(message));
        }
        let size = component.size() * shape.multiplicity();
        let count = usize::try_from(accessor.count.0).unwrap_or(usize::MAX);
        if count == 0 {
            return Err(Error::invalid("is empty"));
        }
        let own = match accessor.buffer_view {
            None => None,
            Some(view) => {
                let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
                let stride = file.root.buffer_views.get(view.value()).and_then(|v| v.byte_stride);
                let stride = stride.map_or(size, |stride| stride.0);
                Some(
                    run(buffers.view(reader, file, view.value())?, offset, count, size, stride)
                        .map_err(|what| about_view(view.value(), &what))?,
                )
            }
        };
        let mut replaced = None;
        if let Some(sparse) = &accessor.sparse {
            let few = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
            if few == 0 || few > count {
                return Err(Error::invalid("has no sparse values, or more than it has values"));
            }
            let Checked::Valid(index_type) = &sparse.indices.component_type else {
                return Err(Error::invalid("has sparse indices of no known type"));
            };
            let part = |view: usize,
                        offset: u64,
                        size: usize,
                        buffers: &mut Buffers,
                        reader: &mut Reader| {
                let bytes = buffers.view(reader, file, view)?;
                run(bytes, offset, few, size, size).map_err(|what| about_view(view, &what))
            };
            let (at, what) = (&sparse.indices, &sparse.values);
            let width = index_type.0.size();
            let indices = part(at.buffer_view.value(), at.byte_offset.0, width, buffers, reader)?;
            let values = part(what.buffer_view.value(), what.byte_offset.0, size, buffers, reader)?;
            // Counted before it is kept: a sparse accessor may be named many times.
            buffers.take(few as u64)?;
            let indices = (0..few).map(|i| (number(index_type.0, indices.at(i, 0)) as usize, i));
            let places: HashMap<usize, usize> = indices.collect();
            if places.keys().any(|place| *place >= count) {
                return Err(Error::invalid("has a sparse value for one that it does not have"));
            }
            replaced = Some((values, places));
        }
        Ok(Values {
            count,
            components: shape.multiplicity(),
            kind: component,
            normalized: accessor.normalized,
            run: own,
            sparse: replaced,
        })
    }

    /// Whether the file has any data for them; without, they are zeros.
    pub(super) fn has_data(&self) -> bool {
        self.run.is_some() || self.sparse.is_some()
    }

    /// Whether they are floats, or whole numbers that are normalized.
    pub(super) fn are_shares(&self) -> bool {
        self.normalized || self.kind == ComponentType::F32
    }

    fn component(&self, i: usize, component: usize) -> f64 {
        let offset = component * self.kind.size();
        let replaced = self.sparse.as_ref().and_then(|(run, places)| Some((run, *places.get(&i)?)));
        match (replaced, &self.run) {
            // Sparse values stand before those of the view, and before zeros without one.
            (Some((run, at)), _) => number(self.kind, run.at(at, offset)),
            (None, Some(run)) => number(self.kind, run.at(i, offset)),
            (None, None) => 0.0,
        }
    }

    /// A value as numbers, normalized ones from -1 or 0 to 1. What it has not is 0.
    pub(super) fn floats<const N: usize>(&self, i: usize) -> [f64; N] {
        let most = match self.kind {
            _ if !self.normalized => 1.0,
            ComponentType::I8 => f64::from(i8::MAX),
            ComponentType::U8 => f64::from(u8::MAX),
            ComponentType::I16 => f64::from(i16::MAX),
            ComponentType::U16 => f64::from(u16::MAX),
            ComponentType::U32 | ComponentType::F32 => 1.0,
        };
        std::array::from_fn(|component| match component < self.components {
            // -128 and -127 are both -1, as the specification has it.
            true if self.normalized => (self.component(i, component) / most).max(-1.0),
            true => self.component(i, component),
            false => 0.0,
        })
    }

    /// A value as whole numbers.
    pub(super) fn wholes<const N: usize>(&self, i: usize) -> [u32; N] {
        std::array::from_fn(|component| match component < self.components {
            true => self.component(i, component) as u32,
            false => 0,
        })
    }
}

fn about_view(view: usize, what: &str) -> Error {
    Error::invalid(format!("uses buffer view {view}{what}"))
}

/// Elements in a part of a buffer.
fn run(
    (data, part): (Arc<Vec<u8>>, Range<usize>),
    offset: u64,
    count: usize,
    size: usize,
    stride: usize,
) -> std::result::Result<Run, String> {
    // Without this, elements would overlap and few bytes could become any number of values.
    if stride < size {
        return Err(format!(", whose stride {stride} is less than the {size} bytes of an element"));
    }
    let end = (stride as u64)
        // The last element may end before its stride does.
        .checked_mul(count as u64 - 1)
        .and_then(|bytes| bytes.checked_add(size as u64))
        .and_then(|bytes| bytes.checked_add(offset));
    if end.is_none_or(|end| end > part.len() as u64) {
        return Err(format!(
            " of {} bytes, which is too short for {count} values from byte {offset} on",
            part.len()
        ));
    }
    Ok(Run { data, start: part.start + offset as usize, stride })
}

/// The number that bytes begin with.
fn number(kind: ComponentType, bytes: &[u8]) -> f64 {
    let of = |n: usize| -> [u8; 4] {
        std::array::from_fn(|i| bytes.get(i).copied().filter(|_| i < n).unwrap_or(0))
    };
    let [a, b, ..] = of(2);
    match kind {
        ComponentType::I8 => f64::from(a as i8),
        ComponentType::U8 => f64::from(a),
        ComponentType::I16 => f64::from(i16::from_le_bytes([a, b])),
        ComponentType::U16 => f64::from(u16::from_le_bytes([a, b])),
        ComponentType::U32 => f64::from(u32::from_le_bytes(of(4))),
        ComponentType::F32 => f64::from(f32::from_le_bytes(of(4))),
    }
}

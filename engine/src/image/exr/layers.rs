//! Which channels of a file are which layer of which view: by the naming of all programs that are known.
//!
//! A channel is called `layer.component`, or `component` alone in the main layer. A part's name is that of its
//! layer where channels do not say it (Nuke, Gaffer); it may end in the view's, as `rgba.left`. In files of one
//! part with several views, the view stands before the component, but for the first of them: `right.R`,
//! `diffuse.right.R`.

use exr::meta::header::Header;
use exr::prelude::SampleType;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::super::format::Format;
use crate::error::{Error, Result};
use crate::text::list;

/// What is read of a file with layers.
#[derive(Clone, Copy)]
pub struct Select<'a> {
    /// The layer whose colour becomes that of the picture. Without, the main layer, or the only one that has colour.
    pub layer: Option<&'a str>,
    /// The part, by its name or its number from 0. Without, all.
    pub part: Option<&'a str>,
    /// The view. Without, the first.
    pub view: Option<&'a str>,
    /// Whether the picture must have colour.
    pub needs_color: bool,
    /// Whether a channel is wanted, by the name that it gets: `R`, `G`, `B` and `A`, or `layer.component`.
    pub wants: &'a (dyn Fn(&str) -> bool + Sync),
}

impl Select<'static> {
    /// All that there is, with colour or without.
    pub fn all() -> Select<'static> {
        Select { layer: None, part: None, view: None, needs_color: false, wants: &|_| true }
    }

    /// The colour alone.
    pub fn color() -> Select<'static> {
        let wants = &|name: &str| matches!(name, "R" | "G" | "B" | "A");
        Select { needs_color: true, wants, ..Select::all() }
    }
}

impl Select<'_> {
    /// Whether nothing is selected of a format that has nothing to select.
    pub(in crate::image) fn check_absent(&self, path: &Path, format: Format) -> Result<()> {
        let asked = [("layer", self.layer), ("part", self.part), ("view", self.view)];
        match asked.into_iter().find(|(_, value)| value.is_some()) {
            None => Ok(()),
            Some((field, _)) => Err(Error::in_file(
                path,
                format!("`{field}` is of OpenEXR files: a {} has none", format.name()),
            )),
        }
    }
}

/// The layers of a file.
#[derive(Clone, Debug, Default)]
pub struct Layers {
    /// The layers.
    pub layers: Vec<Layer>,
    /// The views, if it has several.
    pub views: Vec<String>,
    /// The parts that are deep, by their names or numbers: they are not read as pictures.
    pub deep: Vec<String>,
    pub(super) channels: Vec<Channel>,
}

/// A layer.
#[derive(Clone, Debug)]
pub struct Layer {
    /// Its name; nothing for the main layer.
    pub name: String,
    /// The view, if there are several.
    pub view: String,
    /// The name of its part, if there are several.
    pub part: Option<String>,
    /// Its components, and the type of each: half, float or whole (UINT).
    pub components: Vec<(String, &'static str)>,
}

#[derive(Clone, Debug)]
pub(super) struct Channel {
    pub(super) part: usize,
    /// Its number there.
    pub(super) at: usize,
    pub(super) layer: String,
    pub(super) component: String,
    view: String,
    pub(super) kind: SampleType,
}

impl Channel {
    /// What a picture calls it.
    pub(super) fn name(&self) -> String {
        match &*self.layer {
            "" => self.component.clone(),
            layer => format!("{layer}.{}", self.component),
        }
    }
}

/// Which of red, green, blue and alpha a component is.
fn color_of(component: &str) -> Option<usize> {
    match component.to_ascii_lowercase().as_str() {
        "r" | "red" => Some(0),
        "g" | "green" => Some(1),
        "b" | "blue" => Some(2),
        "a" | "alpha" => Some(3),
        _ => None,
    }
}

/// How the colour of a layer is made of its channels.
#[derive(Debug)]
pub(super) enum Recipe<'a> {
    /// Red, green, blue and alpha, those that there are.
    Colors([Option<&'a Channel>; 4]),
    /// Luminance, and what red and blue have more than it.
    Luminance { y: &'a Channel, chroma: Option<[&'a Channel; 2]>, alpha: Option<&'a Channel> },
}

fn view_words(view: &str) -> String {
    if view.is_empty() { String::new() } else { format!(" of view \"{view}\"") }
}

impl Layers {
    /// The layers of the parts of a file.
    pub(super) fn of(headers: &[Header]) -> Layers {
        let mut made = Layers::default();
        let text = |text: &Option<exr::prelude::Text>| text.as_ref().map(ToString::to_string);
        let is_multi_part = headers.len() > 1;
        for (part, header) in headers.iter().enumerate() {
            let own = &header.own_attributes;
            let part_name = text(&own.layer_name).unwrap_or_default();
            if header.deep {
                made.deep.push(if part_name.is_empty() { part.to_string() } else { part_name });
                continue;
            }
            let views: Vec<String> =
                own.multi_view_names.iter().flatten().map(ToString::to_string).collect();
            let part_view = text(&own.view_name).unwrap_or_default();
            // What the part calls its layer.
            let part_layer = match part_name.strip_suffix(&part_view) {
                Some(rest)
                    if !part_view.is_empty() && (rest.is_empty() || rest.ends_with(['.', '_'])) =>
                {
                    rest.trim_end_matches(['.', '_'])
                }
                _ => &part_name,
            };
            let is_main = |name: &str| {
                let name = name.to_ascii_lowercase();
                matches!(&*name, "" | "rgba" | "rgb" | "main" | "color" | "default")
            };
            for (at, channel) in header.channels.list.iter().enumerate() {
                let name = channel.name.to_string();
                // Layers may lie in layers: only the last word is the component.
                let (prefix, component) = name.rsplit_once('.').unwrap_or(("", &name));
                let mut layer: Vec<&str> =
                    prefix.split('.').filter(|word| !word.is_empty()).collect();
                let mut view = part_view.clone();
                if let (true, Some(first)) = (part_view.is_empty(), views.first()) {
                    match layer.last().filter(|word| views.iter().any(|view| view == *word)) {
                        Some(own) => {
                            view = (*own).to_owned();
                            layer.pop();
                        }
                        // The specification: channels without a view's name are of the first.
                        None => view.clone_from(first),
                    }
                }
                let mut layer = layer.join(".");
                if layer.is_empty() && is_multi_part && !is_main(part_layer) {
                    part_layer.clone_into(&mut layer);
                }
                let component = component.to_owned();
                let kind = channel.sample_type;
                made.channels.push(Channel { part, at, layer, component, view, kind });
            }
        }
        let views: BTreeSet<&String> = made.channels.iter().map(|channel| &channel.view).collect();
        if views.len() > 1 {
            made.views = views.into_iter().filter(|view| !view.is_empty()).cloned().collect();
        }
        let mut layers: BTreeMap<(usize, &str, &str), Layer> = BTreeMap::new();
        for channel in &made.channels {
            let key = (channel.part, &*channel.view, &*channel.layer);
            let layer = layers.entry(key).or_insert_with(|| Layer {
                name: channel.layer.clone(),
                view: channel.view.clone(),
                part: is_multi_part.then(|| {
                    text(&headers[channel.part].own_attributes.layer_name)
                        .filter(|name| !name.is_empty())
                        .unwrap_or_else(|| channel.part.to_string())
                }),
                components: Vec::new(),
            });
            let kind = match channel.kind {
                SampleType::F16 => "half",
                SampleType::F32 => "float",
                SampleType::U32 => "whole",
            };
            layer.components.push((channel.component.clone(), kind));
        }
        made.layers = layers.into_values().collect();
        made
    }

    /// The channels of the part and the view that are selected.
    ///
    /// # Errors
    /// If there is no such part or view.
    pub(super) fn selected(
        &self,
        path: &Path,
        headers: &[Header],
        select: &Select<'_>,
    ) -> Result<Vec<&Channel>> {
        let mut channels: Vec<&Channel> = self.channels.iter().collect();
        if let Some(wanted) = select.part {
            let name = |part: usize| {
                headers[part].own_attributes.layer_name.as_ref().map(ToString::to_string)
            };
            let by_name = (0..headers.len()).find(|part| name(*part).as_deref() == Some(wanted));
            let by_number = wanted.parse().ok().filter(|part| *part < headers.len());
            let Some(part) = by_name.or(by_number) else {
                let names: Vec<String> =
                    (0..headers.len()).map(|part| name(part).unwrap_or_default()).collect();
                let names = names.iter().enumerate().map(|(part, name)| match &**name {
                    "" => part.to_string(),
                    name => name.to_owned(),
                });
                let names: Vec<String> = names.collect();
                let known = list(names.iter().map(String::as_str));
                let what = format!("it has no part \"{wanted}\": its parts are {known}");
                return Err(Error::in_file(path, what));
            };
            if headers[part].deep {
                return Err(deep(path, &[wanted.to_owned()]));
            }
            channels.retain(|channel| channel.part == part);
        }
        if let Some(wanted) = select.view {
            let is_known = channels.iter().any(|channel| channel.view == wanted);
            if !is_known {
                let views: BTreeSet<&str> = channels.iter().map(|c| &*c.view).collect();
                let views: Vec<&str> = views.into_iter().filter(|view| !view.is_empty()).collect();
                let known = match views.is_empty() {
                    true => "it says nothing of views".to_owned(),
                    false => format!("its views are {}", list(views)),
                };
                let what = format!("it has no view \"{wanted}\": {known}");
                return Err(Error::in_file(path, what));
            }
        }
        let first = channels.iter().map(|channel| &channel.view).find(|view| !view.is_empty());
        let view = select.view.map(str::to_owned).or_else(|| first.cloned()).unwrap_or_default();
        channels.retain(|channel| channel.view.is_empty() || channel.view == view);
        if channels.is_empty() {
            let what = "it has no channels";
            return Err(match self.deep.is_empty() {
                true => Error::in_file(path, what),
                false => deep(path, &self.deep),
            });
        }
        Ok(channels)
    }

    /// How the colour is made, and of which layer; nothing if there is none and none is needed.
    ///
    /// # Errors
    /// If there is no such layer, none or several have colour, or it is of whole numbers.
    pub(super) fn color<'c>(
        &self,
        path: &Path,
        channels: &[&'c Channel],
        select: &Select<'_>,
    ) -> Result<Option<(String, Recipe<'c>)>> {
        let mut layers: BTreeMap<&'c str, Vec<&'c Channel>> = BTreeMap::new();
        for channel in channels {
            layers.entry(&channel.layer).or_default().push(channel);
        }
        let (name, own) = match select.layer {
            Some(wanted) => {
                let end = format!(".{wanted}");
                let exact = layers.get_key_value(wanted);
                let mut ends = layers.iter().filter(|(name, _)| name.ends_with(&end));
                let found = exact.or_else(|| ends.next().filter(|_| ends.next().is_none()));
                let Some((name, own)) = found else {
                    let known: Vec<&str> =
                        layers.keys().copied().filter(|name| !name.is_empty()).collect();
                    let known = match known.is_empty() {
                        true => "it has only its main layer: leave `layer` out".to_owned(),
                        false => format!("its layers are {}", list(known)),
                    };
                    let what = format!("it has no layer \"{wanted}\": {known}");
                    return Err(Error::in_file(path, what));
                };
                (*name, own)
            }
            None => {
                let has_color = |name: &str, own: &[&Channel]| {
                    // Cryptomatte has channels called red, green and blue that hold ids and
                    // coverages.
                    let is_crypto = name.to_ascii_lowercase().contains("crypto");
                    let is_light = own.iter().any(|c| {
                        color_of(&c.component).is_some_and(|k| k < 3) || c.component == "Y"
                    });
                    is_light && !is_crypto
                };
                let main = layers.get_key_value("").filter(|(name, own)| has_color(name, own));
                let others: Vec<_> =
                    layers.iter().filter(|(name, own)| has_color(name, own)).collect();
                match (main, &others[..]) {
                    (Some((name, own)), _) => (*name, own),
                    (None, [(name, own)]) => (**name, *own),
                    _ if !select.needs_color => return Ok(None),
                    (None, []) => {
                        let all: Vec<String> = channels.iter().map(|c| c.name()).collect();
                        let all = list(all.iter().map(String::as_str));
                        let what = format!(
                            "it has no colour (R, G, B or Y): its channels are {all}; name one by `layer`"
                        );
                        return Err(Error::in_file(path, what));
                    }
                    (None, several) => {
                        let several = list(several.iter().map(|(name, _)| **name));
                        let what = format!(
                            "several of its layers have colour: name one of {several} by `layer`"
                        );
                        return Err(Error::in_file(path, what));
                    }
                }
            }
        };
        let recipe = recipe(path, name, own)?;
        Ok(Some((name.to_owned(), recipe)))
    }
}

/// That parts are deep.
pub(super) fn deep(path: &Path, parts: &[String]) -> Error {
    let which = match parts {
        [one] if !one.is_empty() => format!(" (part \"{one}\")"),
        _ => String::new(),
    };
    let what = format!(
        "it is deep{which}: its samples lie behind each other, and no picture is read of them; flatten it first"
    );
    Error::in_file(path, what)
}

/// How the colour of a layer is made.
fn recipe<'c>(path: &Path, name: &str, own: &[&'c Channel]) -> Result<Recipe<'c>> {
    let mut colors: [Option<&'c Channel>; 4] = [None; 4];
    for channel in own {
        let Some(k) = color_of(&channel.component) else { continue };
        if let Some(other) = colors[k] {
            let same = if other.view == channel.view { "" } else { ", of several views" };
            let which = if name.is_empty() { "its main layer" } else { name };
            let cure = match other.part == channel.part {
                true => "it cannot be told which is meant",
                false => "name one by `part`",
            };
            let what = format!("{which} has several channels {}{same}: {cure}", channel.component);
            return Err(Error::in_file(path, what));
        }
        colors[k] = Some(channel);
    }
    let named = |name: &str| own.iter().copied().find(|channel| channel.component == name);
    let recipe = if colors[..3].iter().any(Option::is_some) {
        match colors {
            // A mask in red alone is grey.
            [Some(red), None, None, alpha] => Recipe::Luminance { y: red, chroma: None, alpha },
            colors => Recipe::Colors(colors),
        }
    } else if let Some(y) = named("Y") {
        let chroma = named("RY").zip(named("BY")).map(|(red, blue)| [red, blue]);
        let is_vector = named("X").is_some() && named("Z").is_some();
        match (is_vector, named("X"), named("Z")) {
            (true, x, z) => Recipe::Colors([x, Some(y), z, colors[3]]),
            _ => Recipe::Luminance { y, chroma, alpha: colors[3] },
        }
    } else {
        // Vectors and other numbers, one after the other.
        match own {
            [one] => Recipe::Luminance { y: one, chroma: None, alpha: None },
            several => {
                let at = |k: usize| several.get(k).copied();
                Recipe::Colors([at(0), at(1), at(2), None])
            }
        }
    };
    let used: Vec<&Channel> = match &recipe {
        Recipe::Colors(all) => all.iter().copied().flatten().collect(),
        Recipe::Luminance { y, chroma, alpha } => {
            std::iter::once(*y).chain(chroma.iter().flatten().copied()).chain(*alpha).collect()
        }
    };
    if let Some(whole) = used.iter().find(|channel| channel.kind == SampleType::U32) {
        let what = format!(
            "its channel {}{} is of whole numbers (UINT), as ids are: it is no colour; name another layer",
            whole.name(),
            view_words(&whole.view)
        );
        return Err(Error::in_file(path, what));
    }
    Ok(recipe)
}

//! What can be typed.

use clap::builder::TypedValueParser;
use clap::{Args as ClapArgs, Parser, Subcommand, ValueEnum};
use spandrel_engine::moment::Frames;
use spandrel_engine::output;
use spandrel_engine::raster::Raster;
use spandrel_engine::resolve::Framing;
use std::path::PathBuf;

/// Composites three-dimensional pictures as spans, not pixels.
///
/// Exit codes: 0 done, 1 evaluating or writing failed, or there were warnings and --deny-warnings, 2 wrong usage,
/// 3 the graph is invalid, 4 an input is missing or unreadable, 5 some frames failed and --keep-going, 130 interrupted.
#[derive(Debug, Parser)]
#[command(name = "spandrel", version)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Refuse pictures that take more than this when they are decoded, such as 8G. Default: a quarter of the memory.
    #[arg(long, value_name = "BYTES", value_parser = bytes, global = true)]
    pub(crate) largest_picture: Option<usize>,
    /// Exit with 1 if there was a warning; what is written stays.
    #[arg(long, global = true)]
    pub(crate) deny_warnings: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Render(Render),
    Check(Check),
    Nodes(Nodes),
    Measure(Measure),
    Inspect(Inspect),
    Pick(Pick),
    Info(Info),
    Convert(Convert),
    Diff(Diff),
    Merge(Merge),
    Cache(Cache),
    New(New),
    Submit(Submit),
    Completions(Completions),
}

/// Evaluates a graph and writes its pictures.
#[derive(Debug, ClapArgs)]
pub(crate) struct Render {
    /// The graph; - is the standard input, with files as seen from the current folder.
    pub(crate) graph: PathBuf,
    /// Write to this file instead of the one that the graph names. - is the standard output, -.png, -.exr and -.span
    /// say in which format.
    #[arg(short, long, value_name = "FILE", allow_hyphen_values = true, value_parser = place())]
    pub(crate) output: Option<PathBuf>,
    /// Evaluate this node only: one that writes a file, or, with -o, one that makes a picture
    /// or, for a .span file, spans. May be
    /// given several times. Default: every node that writes a file.
    #[arg(short = 'w', long = "write", value_name = "NODE")]
    pub(crate) write: Vec<String>,
    /// The frames to render, such as 1-48, 1-100x2,150 or -5--1. Default: those that the graph names, or 1.
    #[arg(short = 'F', long, value_name = "RANGE", allow_hyphen_values = true)]
    pub(crate) frames: Option<Frames>,
    /// Set a field of a node, such as picture.lines=Sloped(4), or a parameter of the graph, such as haze=0.1. May be
    /// given several times.
    #[arg(long, value_name = "NODE.FIELD=VALUE", value_parser = setting)]
    pub(crate) set: Vec<Setting>,
    /// Take the fast end of whatever trades speed for accuracy: one line to a row, no shadows, one ray, half the size.
    /// It is told; --set, --size and --scale go before it.
    #[arg(long)]
    pub(crate) draft: bool,
    /// Solve visibility at this size in all pictures.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<(u32, u32)>,
    /// Scale all pictures, without solving visibility again.
    #[arg(long, value_name = "SX[,SY]", value_parser = scale)]
    pub(crate) scale: Option<(f64, f64)>,
    /// Compute this part of all pictures only. Without -o, it is written to a file of its own: NAME.X,Y,W,H.png.
    #[arg(long, value_name = "X,Y,W,H", value_parser = window)]
    pub(crate) window: Option<[u32; 4]>,
    /// Make every picture in so many bands of rows, one after another, and join them: the same picture. Bands that others
    /// made with --band are taken from the cache.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) bands: Option<u32>,
    /// Make one band of every picture, such as 3/8, store it in the cache, and write nothing: --bands 8 joins them.
    #[arg(long, value_name = "K/N", value_parser = band, conflicts_with_all = ["bands", "no_cache"])]
    pub(crate) band: Option<(u32, u32)>,
    /// Use this many threads. Default: one for each processor.
    #[arg(short = 'j', long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
    /// Hold no more than this of the pictures on surfaces, such as 512M or 2G; what does not fit is read again.
    #[arg(long, value_name = "BYTES", value_parser = bytes, default_value = "1G")]
    pub(crate) textures: usize,
    /// Keep values that may be needed again as long as all, with those in use, take no more than this, such as 8G.
    /// Default: a quarter of the memory.
    #[arg(long, value_name = "BYTES", value_parser = bytes)]
    pub(crate) memory: Option<usize>,
    /// Store results in this folder and take them from there; any number of processes may share it. Default: what
    /// the variable SPANDREL_CACHE says, or none.
    #[arg(long, value_name = "FOLDER")]
    pub(crate) cache: Option<PathBuf>,
    /// Keep that folder below this size: what is old, large and quickly made goes first.
    #[arg(long, value_name = "BYTES", value_parser = bytes, default_value = "20G")]
    pub(crate) cache_size: usize,
    /// Store nothing, and take nothing that is stored.
    #[arg(long, conflicts_with = "cache")]
    pub(crate) no_cache: bool,
    /// Evaluate nothing; say what would be.
    #[arg(short = 'n', long)]
    pub(crate) dry_run: bool,
    /// Print time, spans and bytes of every node; as JSON, also what was written, warnings and errors, whatever fails.
    #[arg(long, value_name = "FORMAT", num_args = 0..=1, require_equals = true, default_missing_value = "table")]
    pub(crate) stats: Option<Format>,
    /// Print what was asked of every node, and what became of it.
    #[arg(long)]
    pub(crate) explain: bool,
    /// Leave files alone that exist already, and evaluate nothing for them.
    #[arg(long)]
    pub(crate) no_clobber: bool,
    /// Go on with the other frames if one fails; exit with 5 then.
    #[arg(long)]
    pub(crate) keep_going: bool,
    /// Print how the render goes to the standard output, for programs: an object of JSON in each line.
    #[arg(long, conflicts_with = "stats")]
    pub(crate) json: bool,
    /// Print nothing but errors and warnings.
    #[arg(short, long, conflicts_with = "verbose")]
    pub(crate) quiet: bool,
    /// Print a line for every node, as without a terminal.
    #[arg(short, long)]
    pub(crate) verbose: bool,
}

/// How statistics are printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// For people.
    Table,
    /// For programs, to the standard output.
    Json,
}

/// Checks a graph and the scenes that it reads, and reports every error at once; evaluates nothing else.
#[derive(Debug, ClapArgs)]
pub(crate) struct Check {
    /// The graph.
    pub(crate) graph: PathBuf,
    /// The frames to check. Default: those that the graph names, or 1.
    #[arg(short = 'F', long, value_name = "RANGE", allow_hyphen_values = true)]
    pub(crate) frames: Option<Frames>,
    /// Set a field of a node, or a parameter of the graph, before checking.
    #[arg(long, value_name = "NODE.FIELD=VALUE", value_parser = setting)]
    pub(crate) set: Vec<Setting>,
}

/// Lists the kinds of node, or describes one.
#[derive(Debug, ClapArgs)]
pub(crate) struct Nodes {
    /// The kind to describe.
    pub(crate) kind: Option<String>,
    /// Print everything as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Says what is in a file, and what is wrong with it.
#[derive(Debug, ClapArgs)]
pub(crate) struct Info {
    /// A scene of any format, a graph, a .span file, a picture, a volume (.nrrd, .cube), or a lamp's photometry (.ies,
    /// .ldt).
    pub(crate) file: PathBuf,
    /// Measures a volume's surfaces at these values: area, volume, Euler number.
    #[arg(long, value_name = "A,B,..", value_delimiter = ',', allow_negative_numbers = true)]
    pub(crate) level: Vec<f64>,
    /// Samples from cell to cell for `--level`, as `step` of `Isosurface`.
    #[arg(long, value_name = "N", default_value_t = 1.0, requires = "level")]
    pub(crate) step: f64,
    /// For `--level` and what is told, which value of a point is taken where it has several, from 0 on.
    #[arg(long, value_name = "N")]
    pub(crate) component: Option<u32>,
    /// Lists all objects and materials of a scene, however many.
    #[arg(long)]
    pub(crate) all: bool,
    /// Draws a lamp's intensities to this .svg.
    #[arg(short, long, value_name = "FILE", allow_hyphen_values = true, value_parser = place())]
    pub(crate) output: Option<PathBuf>,
}

/// Converts a scene to Spandrel's own text (.ron) or binary (.scene) format. Pictures stay where they are, and the new
/// file names them as seen from its own folder.
#[derive(Debug, ClapArgs)]
pub(crate) struct Convert {
    /// The scene to read, of any format.
    pub(crate) from: PathBuf,
    /// The file to write, ending in .ron or .scene.
    pub(crate) to: PathBuf,
    /// Copy pictures and lamps to a folder beside the new file, NAME_pictures; those that a GLB holds become files.
    #[arg(long)]
    pub(crate) copy_pictures: bool,
}

/// Measures what accuracy costs: varies parameters of a graph, and compares with a reference.
///
/// Every setting is rendered several times by a process of its own. Printed are the error of the colours
/// (R, G, B, A, scene-linear) against the reference, the time without writing, and memory.
#[derive(Debug, ClapArgs)]
pub(crate) struct Measure {
    /// The graph.
    pub(crate) graph: PathBuf,
    /// The values of a parameter, such as picture.lines=Sloped(2),Sloped(4),Sampled(4,Box). With several
    /// parameters all combinations are measured.
    #[arg(long, value_name = "NODE.PARAM=A,B,..", value_parser = setting, required = true)]
    pub(crate) vary: Vec<Setting>,
    /// What is taken as the truth, such as picture.lines=Sloped(256).
    #[arg(long, value_name = "NODE.PARAM=VALUE", value_parser = setting, required = true)]
    pub(crate) reference: Vec<Setting>,
    /// The picture. Default: the only one that the graph writes.
    #[arg(short = 'w', long = "write", value_name = "NODE")]
    pub(crate) write: Option<String>,
    /// The frame. Default: the first that the graph names, or 1.
    #[arg(short = 'F', long, value_name = "FRAME", allow_hyphen_values = true)]
    pub(crate) frame: Option<Frames>,
    /// Solve visibility at this size.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<(u32, u32)>,
    /// Runs of every setting; their median time counts.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) runs: u32,
    /// Write the measurement to a .csv, .svg or .html file. May be given several times.
    #[arg(short, long, value_name = "FILE", allow_hyphen_values = true, value_parser = place())]
    pub(crate) output: Vec<PathBuf>,
    /// Print the table only.
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// An image of spans that a command looks at.
#[derive(Debug, ClapArgs)]
pub(crate) struct Look {
    /// The graph.
    pub(crate) graph: PathBuf,
    /// The image: a node that makes a SpanImage. Default: the one that is resolved.
    #[arg(short = 'w', long = "write", value_name = "NODE")]
    pub(crate) write: Option<String>,
    /// Solve visibility at this size.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<(u32, u32)>,
    /// The frame. Default: the first that the graph names, or 1.
    #[arg(short = 'F', long, value_name = "FRAME", allow_hyphen_values = true)]
    pub(crate) frame: Option<Frames>,
    /// Set a field of a node, or a parameter of the graph, first.
    #[arg(long, value_name = "NODE.FIELD=VALUE", value_parser = setting)]
    pub(crate) set: Vec<Setting>,
}

/// Draws one line of an image as svg: depths and spans, of the image and of what it is merged from.
#[derive(Debug, ClapArgs)]
pub(crate) struct Inspect {
    #[command(flatten)]
    pub(crate) look: Look,
    /// Where the line lies, in pixels from the top; the first line at or below it is drawn.
    #[arg(long, value_name = "Y")]
    pub(crate) line: f64,
    /// Draw these columns only.
    #[arg(long, value_name = "FROM,TO", value_parser = columns)]
    pub(crate) columns: Option<[u32; 2]>,
    /// Write to this file. Default: the standard output.
    #[arg(short, long, value_name = "FILE", allow_hyphen_values = true, value_parser = place())]
    pub(crate) output: Option<PathBuf>,
}

/// Tells what is seen in a pixel: objects, faces, seals, materials, distances, and their shares.
#[derive(Debug, ClapArgs)]
pub(crate) struct Pick {
    #[command(flatten)]
    pub(crate) look: Look,
    /// The column from the left and the row from the top, from 0, in pixels of the size that visibility is solved for.
    #[arg(long, value_name = "X,Y", value_parser = pixel)]
    pub(crate) pixel: [u32; 2],
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Merges span files by depth into another, exactly, a few rows at a time: memory does not grow with the
/// height.
#[derive(Debug, ClapArgs)]
pub(crate) struct Merge {
    /// The files, of one camera, size and line plan.
    #[arg(required = true, num_args = 1..)]
    pub(crate) inputs: Vec<PathBuf>,
    /// The file to write, ending in .span.
    #[arg(short, long, value_name = "FILE", allow_hyphen_values = true, value_parser = place())]
    pub(crate) output: PathBuf,
    /// Leave the file alone if it exists.
    #[arg(long)]
    pub(crate) no_clobber: bool,
    /// Print nothing but errors and warnings.
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// Compares two pictures, channel by channel, or two span files, line by line; exits with 1 if they differ.
#[derive(Debug, ClapArgs)]
pub(crate) struct Diff {
    /// A picture, .png or .exr, or a .span file.
    pub(crate) a: PathBuf,
    /// Another.
    pub(crate) b: PathBuf,
    /// The greatest difference that counts as none: of pictures in scene-linear units, of span files the
    /// share of the picture that shows another face.
    #[arg(long, value_name = "T", default_value_t = 0.0)]
    pub(crate) tolerance: f64,
}

/// Says what a folder of stored results holds, or removes them.
///
/// Example: spandrel cache /mnt/fast/spandrel --stats
///
/// Other programs may use the folder meanwhile: what they miss they compute again.
#[derive(Debug, ClapArgs)]
pub(crate) struct Cache {
    /// The folder.
    #[arg(value_name = "DIR")]
    pub(crate) folder: PathBuf,
    /// Print how many results there are, their bytes, the time that they took to make, and when they were used, to an
    /// hour. This is what happens without an option.
    #[arg(long, conflicts_with = "clear")]
    pub(crate) stats: bool,
    /// Remove all results, also those of other versions of Spandrel. The folder and files of others stay.
    #[arg(long)]
    pub(crate) clear: bool,
    /// Print it as JSON; the statistics also for each of the sixteen parts.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Begins a program of a studio's own: Spandrel with a node of its own, ready to be built.
#[derive(Debug, ClapArgs)]
pub(crate) struct New {
    /// The folder to make; its name is the program's.
    #[arg(value_name = "FOLDER")]
    pub(crate) folder: PathBuf,
    /// Where the sources of Spandrel are. Default: where this program was built.
    #[arg(long, value_name = "FOLDER")]
    pub(crate) sources: Option<PathBuf>,
}

/// Makes a job for a farm: a template of the Open Job Description, whose tasks render some frames each.
///
/// `openjd check JOB.json` checks it, and farms that know the description take it as it is.
#[derive(Debug, ClapArgs)]
pub(crate) struct Submit {
    /// The graph.
    pub(crate) graph: PathBuf,
    /// The frames. Default: those that the graph names, or 1.
    #[arg(short = 'F', long, value_name = "RANGE", allow_hyphen_values = true)]
    pub(crate) frames: Option<Frames>,
    /// Frames of a task: what does not move is solved once for all of them.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) chunk: u32,
    /// Processors that a task uses, and asks the farm for.
    #[arg(short = 'j', long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
    /// Bytes that a task keeps values in, such as 8G; the farm is asked for a GiB more.
    #[arg(long, value_name = "BYTES", value_parser = bytes)]
    pub(crate) memory: Option<usize>,
    /// A folder for results that all machines of the farm share.
    #[arg(long, value_name = "FOLDER")]
    pub(crate) cache: Option<PathBuf>,
    /// Divide each frame into so many bands of rows, each a task of its own; a second step joins them exactly.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=1024), requires = "cache")]
    pub(crate) bands: Option<u32>,
    /// Set a field of a node, or a parameter of the graph.
    #[arg(long, value_name = "NODE.FIELD=VALUE", value_parser = setting)]
    pub(crate) set: Vec<Setting>,
    /// Write to this .json file. Default: the standard output.
    #[arg(short, long, value_name = "FILE", allow_hyphen_values = true, value_parser = place())]
    pub(crate) output: Option<PathBuf>,
}

/// Prints a script that completes arguments in a shell.
#[derive(Debug, ClapArgs)]
pub(crate) struct Completions {
    /// The shell.
    pub(crate) shell: clap_complete::Shell,
}

/// A field or parameter set from the command line.
#[derive(Clone, Debug)]
pub(crate) struct Setting {
    /// The node; none for a parameter of the graph.
    pub(crate) node: Option<String>,
    pub(crate) field: String,
    pub(crate) value: String,
}

impl Setting {
    /// The node and its field, or the parameter.
    pub(crate) fn place(&self) -> String {
        match &self.node {
            Some(node) => format!("{node}.{}", self.field),
            None => self.field.clone(),
        }
    }
}

impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}={}", self.place(), self.value)
    }
}

fn setting(text: &str) -> Result<Setting, String> {
    let wrong = || "write NODE.FIELD=VALUE, such as sun.intensity=2, or PARAMETER=VALUE".to_owned();
    let (place, value) = text.split_once('=').ok_or_else(wrong)?;
    let (node, field) = match place.split_once('.') {
        Some((node, field)) => (Some(node), field),
        None => (None, place),
    };
    if node.is_some_and(str::is_empty) || field.is_empty() || value.is_empty() {
        return Err(wrong());
    }
    let node = node.map(str::to_owned);
    Ok(Setting { node, field: field.to_owned(), value: value.to_owned() })
}

/// A file to write. What begins with a dash is mostly an option before which the file was forgotten.
fn place() -> impl TypedValueParser<Value = PathBuf> {
    clap::builder::OsStringValueParser::new().try_map(|name| {
        let path = PathBuf::from(&name);
        match name.as_encoded_bytes().starts_with(b"-") && !output::is_standard(&path) {
            true => Err("name a file; one whose name begins with - is written as ./-NAME"),
            false => Ok(path),
        }
    })
}

fn numbers<T: std::str::FromStr>(text: &str, separator: char) -> Option<Vec<T>> {
    text.split(separator).map(|part| part.trim().parse().ok()).collect()
}

fn size(text: &str) -> Result<(u32, u32), String> {
    match numbers(&text.to_lowercase(), 'x').as_deref() {
        Some([width, height]) => {
            Raster::new(*width, *height).map_err(|e| e.to_string())?;
            Ok((*width, *height))
        }
        _ => Err("write width x height in pixels, such as 1920x1080".to_owned()),
    }
}

fn bytes(text: &str) -> Result<usize, String> {
    let units = [('K', 10), ('M', 20), ('G', 30), ('T', 40)];
    let upper = text.to_uppercase();
    let unit = units.into_iter().find(|(unit, _)| upper.ends_with(*unit));
    let (digits, shift) = match unit {
        Some((unit, shift)) => (upper.trim_end_matches(unit), shift),
        None => (upper.as_str(), 0),
    };
    let number: Option<usize> = digits.trim().parse().ok();
    number
        .and_then(|number| number.checked_mul(1 << shift))
        .filter(|bytes| *bytes >= 1 << 20)
        .ok_or_else(|| "write a number of bytes, 1M or more, such as 512M or 2G".to_owned())
}

fn scale(text: &str) -> Result<(f64, f64), String> {
    let (x, y) = match numbers(text, ',').as_deref() {
        Some([both]) => (*both, *both),
        Some([x, y]) => (*x, *y),
        _ => return Err("write one factor or two, such as 0.5 or 2,1".to_owned()),
    };
    Framing::check_scale((x, y).into()).map_err(|e| e.to_string())?;
    Ok((x, y))
}

fn pixel(text: &str) -> Result<[u32; 2], String> {
    columns(text)
        .map_err(|_| "write column,row in pixels from the top left, such as 400,300".to_owned())
}

fn columns(text: &str) -> Result<[u32; 2], String> {
    numbers(text, ',')
        .and_then(|numbers| <[u32; 2]>::try_from(numbers).ok())
        .ok_or_else(|| "write from,to in pixels, such as 200,400".to_owned())
}

fn band(text: &str) -> Result<(u32, u32), String> {
    let numbers = text.split_once('/').and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
    let numbers = numbers.filter(|(k, n)| (1..=*n).contains(k) && *n <= 4096);
    numbers.ok_or_else(|| "write which of how many, such as 3/8".to_owned())
}

fn window(text: &str) -> Result<[u32; 4], String> {
    numbers(text, ',')
        .and_then(|numbers| <[u32; 4]>::try_from(numbers).ok())
        .filter(|[x, y, width, height]| {
            let ends = x.checked_add(*width).zip(y.checked_add(*height));
            *width > 0 && *height > 0 && ends.is_some()
        })
        .ok_or_else(|| "write left,top,width,height in pixels, such as 100,50,640,360".to_owned())
}

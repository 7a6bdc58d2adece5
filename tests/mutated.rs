//! A few hundred of the mutations that `cargo run --release -p spandrel-tests --example mutations` makes by
//! thousands.

use spandrel_tests::program::Scratch;

use crate::mutations::{End, Mutations};

#[test]
fn mutated_files_of_every_format_are_read_or_refused_by_name() {
    let folder = Scratch::new("mutated-files");
    let mutations = Mutations::new(folder.path());
    mutations.check_sound();
    let (mut made, mut refused) = (0, 0);
    for run in 0..24 * mutations.kinds() as u64 {
        match mutations.one(run) {
            Ok(End::Made) => made += 1,
            Ok(End::Refused | End::Broke) => refused += 1,
            Err(fault) => panic!("run {run} of {}: {fault}", mutations.name(run)),
        }
    }
    assert!(made > 50 && refused > 200, "{made} read, {refused} refused");
}

//! Turns `src/mavlink/messages.tsv`, the readable source, into a constant table of message definitions.

use std::fmt::Write;
use std::path::Path;
use std::{env, fs};

const SOURCE: &str = "src/mavlink/messages.tsv";

fn main() {
    println!("cargo::rerun-if-changed={SOURCE}");
    println!("cargo::rerun-if-changed=build.rs");
    let tsv = fs::read_to_string(SOURCE).expect("the message table is part of the source");
    let mut rows = String::from("&[\n");
    for (number, line) in tsv.lines().enumerate().skip(1) {
        let fields: Vec<&str> = line.split('\t').collect();
        let [id, extra, name, base, max, system, component, _status, _dialect] = fields[..] else {
            panic!("{SOURCE}:{}: expected 9 fields, found {}", number + 1, fields.len());
        };
        // `base` and `max` exceed 255 in four retired definitions, hence u16 in `Definition`.
        writeln!(rows, "    row({id}, {extra}, {name:?}, {base}, {max}, {system}, {component}),")
            .expect("writing to a String cannot fail");
    }
    rows.push_str("]\n");
    let out = env::var_os("OUT_DIR").expect("cargo sets OUT_DIR");
    fs::write(Path::new(&out).join("messages.rs"), rows).expect("OUT_DIR is writable");
}

use std::fs;

use super::*;
use crate::config::{Address, EndpointConfig, MAX_ENDPOINTS, OPTIONS};
use crate::test_dir::TestDir;

fn parse(text: &str) -> Config {
    parse_config("test.toml", text).unwrap_or_else(|error| panic!("{error}"))
}

/// What several files say together: the endpoints in the spelling of the command line.
fn overlay(texts: &[&str]) -> Result<Vec<String>, ConfigError> {
    let dir = TestDir::new();
    let write = |(number, text): (usize, &&str)| dir.write(&format!("{number}.toml"), text);
    let files: Vec<PathBuf> = texts.iter().enumerate().map(write).collect();
    let config = load_config(&files)?;
    Ok(config.endpoints.iter().map(|endpoint| endpoint.config.to_string()).collect())
}

#[test]
fn keys_and_query_say_the_same() {
    let text = "\
[endpoint.gcs]
address = \"udpin:0.0.0.0:14550\"
max_peers = 0x8
peer_timeout = \"30s\"
queue_time = 0.5
pack = true
dedup = 100
allow_messages_out = [\"RAW_IMU\", 27, 'attitude']
block_systems_in = 255
rate = { ATTITUDE = 2, 33 = 0.5 }
group = \"a & b\"
prefer = 7
";
    let config = parse(text);
    let expected: EndpointConfig = "udpin:?name=gcs&max_peers=8&peer_timeout=30s&queue_time=500ms\
        &pack=true&dedup=100&allow_messages_out=RAW_IMU,27,ATTITUDE&block_systems_in=255\
        &rate=ATTITUDE:2,33:0.5&group=a%20%26%20b&prefer=7"
        .parse()
        .unwrap();
    assert_eq!(config.endpoints[0].config, expected);
    write::assert_reads_back(&config);
}

#[test]
fn a_list_has_several_spellings() {
    for rate in ["[\"ATTITUDE:2\", \"33:0.5\"]", "\"ATTITUDE:2,33:0.5\"", "{ATTITUDE=2, 33=0.5}"] {
        let config = parse(&format!("[endpoint.a]\naddress = \"udpin:\"\nrate = {rate}\n"));
        let text = config.endpoints[0].config.to_string();
        assert_eq!(text, "udpin:0.0.0.0:14550?name=a&rate=ATTITUDE:2,33:0.5");
    }
    let config = parse("endpoint.a.address = \"/dev/ttyS1\"\nendpoint.a.baudrate = [57600, 9600]");
    assert_eq!(config.endpoints[0].config.to_string(), "serial:/dev/ttyS1:57600,9600?name=a");
}

#[test]
fn systems_that_change_places_have_several_spellings() {
    let table = "{from = '1/*', to = '7/*'}";
    for remap in ["['1:7']", "'1:7'", table, &format!("[{table}]")] {
        let config = parse(&format!("[endpoint.a]\naddress = 'udpin:'\nremap = {remap}\n"));
        let text = config.endpoints[0].config.to_string();
        assert_eq!(text, "udpin:0.0.0.0:14550?name=a&remap=1:7", "{remap}");
        write::assert_reads_back(&config);
    }
    let config = parse(
        "[endpoint.a]\naddress = 'udpin:'\n[endpoint.a.remap]\nfrom = \"1/*\"\nto = \"7/*\"\n",
    );
    assert_eq!(config.endpoints[0].config.options.remap, [(1, 7)]);
    let both = parse(&format!("[endpoint.a]\naddress = 'udpin:'\nremap = [{table}, '2:8']\n"));
    assert_eq!(both.endpoints[0].config.options.remap, [(1, 7), (2, 8)]);
}

#[test]
fn endpoints_keep_the_order_of_the_file() {
    let config = parse("[endpoint.z]\naddress='udpin:1'\n[endpoint.a]\naddress='udpin:2'\n");
    let names: Vec<String> = config.endpoints.iter().map(|it| it.config.name()).collect();
    assert_eq!(names, ["z", "a"]);
    let place = config.endpoints[1].place_of("address").unwrap();
    assert_eq!(place.to_string(), "test.toml:4:9");
}

#[test]
fn every_option_is_written_and_read_back() {
    let by_kind = [
        "serial:/dev/ttyS1:57600,9600?flow=rtscts&bandwidth=900",
        "udpout:10.0.0.2:1?bind=0.0.0.0:2&dev=wlan0&mtu=500",
        "tcpout:[fe80::1%wlan0]:1?stall_timeout=1500ms",
        "mcast:239.1.2.3:4?sticky=false&ttl=0",
        "udpin:1?sniffer=true&forward_setup_signing=true&group=%22q%22&path=best&prefer=1",
    ];
    let filters =
        OPTIONS.iter().filter(|spec| spec.name.ends_with("_in") || spec.name.ends_with("_out"));
    let filters: Vec<String> = filters.map(|spec| format!("udpin:9?{}=1,2", spec.name)).collect();
    let texts = by_kind.into_iter().chain(filters.iter().map(String::as_str));
    let mut config = Config::default();
    for (number, text) in texts.enumerate() {
        let mut endpoint: EndpointConfig = text.parse().unwrap();
        endpoint.options.name = Some(format!("no. {number}"));
        config.endpoints.push(endpoint.into());
    }
    config.general.router.strict = true;
    config.general.router.route_age = None;
    config.general.router.sniffer = Some(3);
    config.general.dialect = vec!["/a b.xml".into(), "/c\"d.xml".into()];
    write::assert_reads_back(&config);
}

#[test]
fn endpoints_without_a_name_get_one_that_no_other_has() {
    let long = format!("/dev/serial/by-id/{}", "x".repeat(80));
    let texts = ["udpout:a:1", "udpout:a:1", &long, "udpin:7?name=udpout:a:1"];
    let endpoints = texts.map(|text| text.parse::<EndpointConfig>().unwrap().into()).to_vec();
    let config = Config { endpoints, ..Config::default() };
    let back = parse(&config.to_string());
    let names: Vec<String> = back.endpoints.iter().map(|it| it.config.name()).collect();
    assert_eq!(names, ["udpout:a:1", "udpout:a:1 2", "serial", "udpout:a:1 3"]);
}

#[test]
fn there_is_an_end_to_endpoints() {
    let table = |n: usize| format!("[endpoint.e{n}]\naddress='udpin:1'\n");
    let most: String = (0..MAX_ENDPOINTS).map(table).collect();
    assert_eq!(parse(&most).endpoints.len(), MAX_ENDPOINTS);
    let error = parse_config("a.toml", &(most + &table(MAX_ENDPOINTS))).unwrap_err();
    let text = "a.toml:8193:11: there are 4097 endpoints: 4096 is the most";
    assert_eq!(error.to_string(), text);
}

#[test]
fn a_later_file_overrides_key_by_key() {
    let base =
        "[endpoint.a]\naddress='udpin:1?mtu=500'\npack=true\n[endpoint.b]\naddress='udpin:2'";
    let later = "[endpoint.a]\nmtu=600\n[endpoint.c]\naddress='udpin:3'";
    let both = overlay(&[base, later]).unwrap();
    let expected = [
        "udpin:0.0.0.0:1?name=a&pack=true&mtu=600",
        "udpin:0.0.0.0:2?name=b",
        "udpin:0.0.0.0:3?name=c",
    ];
    assert_eq!(both, expected);
    // A new address replaces the old one with its query, and keys stay.
    let both = overlay(&[base, "[endpoint.a]\naddress='udpin:9'"]).unwrap();
    assert_eq!(both[0], "udpin:0.0.0.0:9?name=a&pack=true");
}

#[test]
fn a_later_file_overrides_baud_rates_wherever_they_stand() {
    let in_address = "[endpoint.a]\naddress='/dev/ttyS1:57600'";
    let as_key = "[endpoint.a]\nbaudrate=9600";
    let both = overlay(&[in_address, as_key]).unwrap();
    assert_eq!(both, ["serial:/dev/ttyS1:9600?name=a"]);
    let base = "[endpoint.a]\naddress='/dev/ttyS1'\nbaudrate=9600";
    let both = overlay(&[base, in_address]).unwrap();
    assert_eq!(both, ["serial:/dev/ttyS1:57600?name=a"]);
}

#[test]
fn an_error_after_merging_names_the_file_it_stands_in() {
    let base = "[endpoint.a]\naddress='/dev/ttyS1'\nflow='rtscts'";
    let error = overlay(&[base, "[endpoint.a]\naddress='udpin:1'"]).unwrap_err();
    let text = error.to_string();
    let expected = "0.toml:3:6: option `flow` does not apply to udpin, only to serial";
    assert!(text.ends_with(expected), "{text}");
}

#[test]
fn the_default_files_are_those_that_are_there() {
    let dir = TestDir::new();
    assert_eq!(default_files(dir.path()), Ok(vec![]));
    let b = dir.write("conf.d/20-b.toml", "");
    let a = dir.write("conf.d/10-a.toml", "");
    dir.write("conf.d/30-c.toml~", "");
    dir.write("conf.d/.40-d.toml", "");
    assert_eq!(default_files(dir.path()), Ok(vec![a.clone(), b.clone()]));
    let main = dir.write("mavswitch.toml", "");
    assert_eq!(default_files(dir.path()), Ok(vec![main, a, b]));
}

#[test]
fn definition_files_are_beside_the_file_that_names_them() {
    let dir = TestDir::new();
    let file = dir.write("x.toml", "dialect = ['a.xml', '/b.xml']");
    let config = load_config(&[file]).unwrap();
    assert_eq!(config.general.dialect, [dir.path().join("a.xml"), "/b.xml".into()]);
}

#[test]
fn what_is_no_text_of_ours_is_refused_with_its_place() {
    let dir = TestDir::new();
    let absent = load_config(&[dir.path().join("absent.toml")]).unwrap_err().to_string();
    assert!(absent.contains("absent.toml: cannot read: No such file"), "{absent}");
    let path = dir.path().join("latin1.toml");
    fs::write(&path, b"# a\n# \xe4").unwrap();
    let latin1 = load_config(&[path]).unwrap_err().to_string();
    assert!(latin1.ends_with("latin1.toml:2:3: not UTF-8: save the file as UTF-8"), "{latin1}");
    let path = dir.write("large.toml", "#".repeat((1 << 20) + 1));
    let large = load_config(&[path]).unwrap_err().to_string();
    assert!(large.contains("larger than 1 MiB"), "{large}");
}

#[test]
fn nasty_text_is_read_back_or_refused() {
    let text = "strict = true\nroute_age = 1.5\ndialect = [\"a\"]\n\
        [endpoint.\"a b\"]\naddress = \"udpin:0.0.0.0:14550?mtu=500\"\nttl = \"5\"\nrate.X = 2\n\
        allow_systems_in = [1, 2]\n[endpoint.b]\naddress = '/dev/ttyS1'\nqueue_time = 1e0\n";
    for cut in 0..text.len() {
        fuzz_config(&text.as_bytes()[..cut]);
        fuzz_config(&text.as_bytes()[cut..]);
        for byte in *b"\0\x1b\n\"'=[]{}.,#1\xff" {
            let mut bytes = text.as_bytes().to_vec();
            bytes[cut] = byte;
            fuzz_config(&bytes);
            bytes.insert(cut, b'\\');
            fuzz_config(&bytes);
        }
    }
    for text in [
        "\u{feff}strict = true",
        "[endpoint.\"\\u0007\"]",
        "endpoint.a.address = \"udpin:\\u001b\"",
        "[endpoint.a]\naddress='udpout:x?bind=[::1%25]'",
        "\"\\u001b[2J\" = 1",
        "strict = \"\\u001b[2J\u{9f}\"",
        "sniffer = 99999999999999999999999",
        "sniffer = -0x1",
        "route_age = nan",
        "endpoint.a = 1979-05-27",
        "[[endpoint]]",
    ] {
        fuzz_config(text.as_bytes());
    }
    fuzz_config("[".repeat(10_000).as_bytes());
    fuzz_config(format!("a = {}", "[".repeat(10_000)).as_bytes());
}

#[test]
fn a_log_is_looked_for_beside_the_file_that_names_it() {
    let dir = TestDir::new();
    let file = dir.write(
        "conf/a.toml",
        "record = 'records'\n[endpoint.a]\naddress = 'tlog:logs/x.tlog?speed=0'\n\
         [endpoint.b]\naddress = 'tlog:/y.tlog'\n",
    );
    let config = load_config(&[file]).unwrap();
    let addresses: Vec<_> = config.endpoints.iter().map(|it| it.config.address.clone()).collect();
    let conf = dir.path().join("conf");
    let expected = [conf.join("logs/x.tlog"), "/y.tlog".into()].map(Address::Tlog);
    assert_eq!(addresses, expected);
    assert_eq!(config.general.record.dir, Some(conf.join("records")));
}

use std::fs;
use std::path::{Path, PathBuf};

use super::*;
use crate::config::{Config, ConfigError, EndpointOptions};
use crate::test_dir::TestDir;

/// The endpoints in the spelling of the command line, without the TCP server.
fn endpoints(config: &Config) -> Vec<String> {
    let texts = config.endpoints.iter().map(|endpoint| endpoint.config.to_string());
    texts.filter(|text| !text.contains("tcp-server")).collect()
}

fn names(files: &RouterdFiles) -> Vec<String> {
    let name = |path: &PathBuf| path.file_name().unwrap().to_str().unwrap().to_owned();
    files.paths.iter().map(name).collect()
}

/// What a command line without files means.
fn command_line(arguments: &RouterdArguments) -> Result<Imported, ConfigError> {
    import_routerd(&RouterdFiles::default(), arguments)
}

fn strings(texts: &[&str]) -> Vec<String> {
    texts.iter().map(|text| (*text).to_owned()).collect()
}

#[test]
fn a_command_line_means_what_it_means_to_mavlink_router() {
    let arguments = RouterdArguments {
        masters: strings(&["/dev/ttyS1:1500000", "/dev/ttyS2", "0.0.0.0:24550", "[::]:24551"]),
        udp: strings(&["192.168.7.1:14550", "127.0.0.1", "127.0.0.1", "[::1]", "10.0.0.255:1"]),
        tcp: strings(&["127.0.0.1:5762"]),
        general: vec![
            ("-t", "TcpServerPort", "0".to_owned()),
            ("-s", "SnifferSysid", "9".to_owned()),
        ],
    };
    let imported = command_line(&arguments).unwrap();
    let expected = [
        "serial:/dev/ttyS1:1500000",
        "serial:/dev/ttyS2:115200",
        "udpin:0.0.0.0:24550",
        "udpin:[::]:24551",
        "udpout:192.168.7.1:14550",
        "udpout:127.0.0.1:14550",
        "udpout:127.0.0.1:14551",
        "udpout:[::1]:14550",
        "udpbcast:10.0.0.255:1",
        "tcpout:127.0.0.1:5762",
    ];
    assert_eq!(endpoints(&imported.config), expected);
    assert_eq!(imported.config.general.router.sniffer, Some(9));
    assert_eq!((imported.notes, imported.tcp_server), (Vec::new(), None));
}

#[test]
fn a_wrong_command_line_is_told_argument_by_argument() {
    let arguments = RouterdArguments {
        masters: strings(&["ttyS1", "0.0.0.0", "/dev/ttyS1:57k6"]),
        udp: strings(&["10.0.0:1", "14550", "[fe80::1]:1", "10.0.0.2:0"]),
        tcp: strings(&["10.0.0.2"]),
        general: vec![("-t", "TcpServerPort", "x".to_owned())],
    };
    let error = command_line(&arguments).unwrap_err().to_string();
    let expected = "\
command line: -t: bad value `x`: expected a port of 1 to 65535, or 0 for none
command line: `ttyS1`: no port: write DEVICE[:BAUD] or IP:PORT
command line: `0.0.0.0`: no port: write DEVICE[:BAUD] or IP:PORT
command line: `/dev/ttyS1:57k6`: bad baud rate `57k6`: write a number of 50 to 20000000, several with commas between
command line: -e `10.0.0:1`: bad host `10.0.0`: write a name, an address like 10.0.0.2, or IPv6 in brackets
command line: -e `14550`: no address: write IP:PORT
command line: -e `[fe80::1]:1`: link-local address without interface: write it like [fe80::1%wlan0]:14550
command line: -e `10.0.0.2:0`: port 0 cannot be sent to: write a number of 1 to 65535
command line: -p `10.0.0.2`: no port: write IP:PORT";
    assert_eq!(error, expected);
}

#[test]
fn the_tcp_server_is_there_unless_it_is_turned_off() {
    let with = |port: &str| RouterdArguments {
        general: vec![("-t", "TcpServerPort", port.to_owned())],
        ..RouterdArguments::default()
    };
    let addresses = |imported: &Imported| -> Vec<String> {
        imported.config.endpoints.iter().map(|it| it.config.address.to_string()).collect()
    };
    let mut unsaid = command_line(&RouterdArguments::default()).unwrap();
    assert_eq!(unsaid.tcp_server, Some(TcpServer { port: 5760, is_written: false }));
    assert_eq!(addresses(&unsaid), ["tcpin:[::]:5760"]);
    unsaid.leave_out_tcp_server("it is taken");
    assert_eq!((addresses(&unsaid).len(), unsaid.notes.len()), (0, 1));
    let moved = command_line(&with("5790")).unwrap();
    assert_eq!(moved.tcp_server, Some(TcpServer { port: 5790, is_written: true }));
    assert_eq!(addresses(&moved), ["tcpin:[::]:5790"]);
    assert_eq!(command_line(&with("0")).unwrap().config.endpoints, []);
}

#[test]
fn files_are_read_in_the_order_of_mavlink_router() {
    let dir = TestDir::new();
    let main = dir.write("main.conf", "[UdpEndpoint a]\nMode=Normal\nAddress=10.0.0.1\nPort=1\n");
    let drop_ins = dir.path().join("config.d");
    dir.write("config.d/20-b.conf", "[UdpEndpoint A]\nPort = 3\n");
    dir.write("config.d/10-a", "[General]\nSnifferSysid=7\n[udpendpoint a]\nPort = 2\nGroup = x\n");
    dir.write("config.d/30.conf~", "[what an editor leaves]\n");
    dir.write("config.d/.30.conf.swp", "[what an editor leaves]\n");
    fs::create_dir_all(drop_ins.join("dir")).unwrap();
    let files = RouterdFiles::find(Some(&main), Some(&drop_ins)).unwrap();
    assert_eq!(names(&files), ["main.conf", "10-a", "20-b.conf"]);
    assert_eq!(RouterdFiles::at(dir.path()).unwrap(), files);
    let imported = import_routerd(&files, &RouterdArguments::default()).unwrap();
    assert_eq!(endpoints(&imported.config), ["udpout:10.0.0.1:3?name=a&group=x"]);
    assert_eq!(imported.config.general.router.sniffer, Some(7));
    // What one file says again of another is meant.
    assert_eq!(imported.notes, []);
    assert_eq!(names(&RouterdFiles::at(&drop_ins).unwrap()), ["10-a", "20-b.conf"]);
    let other = TestDir::new();
    fs::create_dir_all(other.path()).unwrap();
    let error = RouterdFiles::at(other.path()).unwrap_err().to_string();
    assert!(error.ends_with(": no main.conf is in it, no config.d and no other file"), "{error}");
}

#[test]
fn a_file_that_is_not_there_is_left_out_with_a_word() {
    let absent = Path::new("/nonexistent/main.conf");
    let files = RouterdFiles::find(Some(absent), Some(Path::new("/nonexistent/dir"))).unwrap();
    let imported = import_routerd(&files, &RouterdArguments::default()).unwrap();
    let notes: Vec<String> = imported.notes.iter().map(ToString::to_string).collect();
    assert_eq!(notes, ["/nonexistent/main.conf: it is not there: going on without it"]);
    // Who imports it wants it.
    let named = RouterdFiles::at(absent).unwrap();
    assert!(import_routerd(&named, &RouterdArguments::default()).is_err());
}

#[test]
fn the_command_line_overrides_the_files_and_its_endpoints_add_to_theirs() {
    let dir = TestDir::new();
    let text = "[General]\nSnifferSysid=7\nTcpServerPort=1\n[UdpEndpoint a]\nMode=Normal\n\
                Address=127.0.0.1\n";
    let files = RouterdFiles::at(&dir.write("main.conf", text)).unwrap();
    let arguments = RouterdArguments {
        udp: strings(&["127.0.0.1"]),
        general: vec![
            ("-s", "SnifferSysid", "8".to_owned()),
            ("-t", "TcpServerPort", "0".to_owned()),
        ],
        ..RouterdArguments::default()
    };
    let imported = import_routerd(&files, &arguments).unwrap();
    let expected = ["udpout:127.0.0.1:14550?name=a", "udpout:127.0.0.1:14551"];
    assert_eq!(endpoints(&imported.config), expected);
    assert_eq!(imported.config.general.router.sniffer, Some(8));
}

#[test]
fn every_default_that_is_told_is_what_holds() {
    let default = command_line(&RouterdArguments::default()).unwrap();
    for spec in GENERAL_KEYS {
        let Some(text) = spec.default else { continue };
        let general = vec![("-x", spec.name, text.to_owned())];
        let said = command_line(&RouterdArguments { general, ..RouterdArguments::default() });
        let said = said.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((&said.config, &said.notes), (&default.config, &default.notes), "{}", spec.name);
    }
}

#[test]
fn an_endpoint_without_further_keys_has_our_defaults() {
    let dir = TestDir::new();
    let text = "[TcpEndpoint a]\nAddress=10.0.0.2\nPort=1\n";
    let files = RouterdFiles::at(&dir.write("main.conf", text)).unwrap();
    let imported = import_routerd(&files, &RouterdArguments::default()).unwrap();
    let options = &imported.config.endpoints[0].config.options;
    let expected = EndpointOptions { name: Some("a".to_owned()), ..EndpointOptions::default() };
    assert_eq!(*options, expected);
}

#[test]
fn nasty_files_are_refused_or_read_back() {
    let sample = include_bytes!("../../../tests/config/routerd/right/sample.conf");
    fuzz_import(sample);
    for cut in (0..sample.len()).step_by(7) {
        fuzz_import(&sample[..cut]);
        fuzz_import(&sample[cut..]);
        for byte in [0, b'\n', b'=', b'[', b']', b' ', b'#', b',', 0xff] {
            let mut bytes = sample.to_vec();
            bytes[cut] = byte;
            fuzz_import(&bytes);
        }
    }
    for text in [
        "[UartEndpoint a]\nDevice=/dev/x:300",
        "[UartEndpoint a]\nDevice=//dev/x",
        "[UartEndpoint a]\nDevice=/dev/\u{fffd}\u{7}",
        "[UartEndpoint \u{85}]\nDevice=/dev/x",
        "[UartEndpoint a\u{a0}b]\nDevice=/dev/x",
        "[UdpEndpoint a]\nMode=server\nAddress=[ff02::1%1]\nPort=1",
        "[UdpEndpoint a]\nMode=normal\nAddress=255.255.255.255",
        "[TcpEndpoint a 2]\nAddress=x\nPort=1\n[UdpEndpoint a]\nMode=normal\nAddress=x\nPort=2",
        "[]]",
        "[",
        "=",
        "]",
    ] {
        fuzz_import(text.as_bytes());
    }
}

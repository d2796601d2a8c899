use super::*;
use crate::config::parse_config;

fn findings(text: &str) -> Vec<String> {
    let config = parse_config("a.toml", text).unwrap_or_else(|error| panic!("{error}"));
    check(&config).iter().map(ToString::to_string).collect()
}

/// Endpoints on this computer, and one more, of which something is to be said.
#[track_caller]
fn assert_found(text: &str, expected: &[&str]) {
    let config = format!("endpoint.x.address = 'udpin:127.0.0.1:1'\n[endpoint.y]\n{text}\n");
    assert_eq!(findings(&config), expected, "{text}");
}

#[test]
fn what_is_well_is_not_told() {
    assert_found("address = 'tcpin:127.0.0.1:1'", &[]);
    assert_found("address = 'udpin:127.0.0.1:0?mtu=500&pack=true'", &[]);
    assert_found("address = 'udpout:localhost:1?dev=lo'", &[]);
    assert_found("address = 'serial:/dev/null:57600?queue_time=1s'", &[]);
}

#[test]
fn what_is_not_there_is_told() {
    let text = "a.toml:3:11: warning: y: /dev/absent is not there: it will be waited for (is the cable in?)";
    assert_found("address = '/dev/absent'", &[text]);
    let text =
        "a.toml:3:11: warning: y: /etc/passwd is no serial port (`mavswitch ports` lists them)";
    assert_found("address = '/etc/passwd'", &[text]);
    let text = "a.toml:3:11: y: cannot play back /etc/passwd: it is no telemetry log: there is not one \
                whole record in it";
    assert_found("address = 'tlog:/etc/passwd'", &[text]);
    let found = findings("[endpoint.y]\naddress = 'udpin:1'\ndev = 'absent0'");
    assert_eq!(found.len(), 1, "{found:?}");
    let start = "a.toml:3:7: warning: y: interface absent0 is not there";
    assert!(found[0].starts_with(start), "{found:?}");
    let found = findings("[endpoint.y]\naddress = 'udpin:no-such-host.invalid:1'");
    assert_eq!(found.len(), 1, "{found:?}");
    let start = "a.toml:2:11: warning: y: cannot resolve no-such-host.invalid: ";
    assert!(found[0].starts_with(start), "{found:?}");
}

#[test]
fn what_is_taken_is_told() {
    for address in ["udpin:127.0.0.1:1", "udpin:1", "udpout:127.0.0.1:9?bind=:1"] {
        let found = findings(&format!(
            "endpoint.x.address = 'udpin:127.0.0.1:1'\nendpoint.y.address = '{address}'"
        ));
        assert_eq!(found.len(), 1, "{address}: {found:?}");
        assert!(found[0].starts_with("a.toml:2:22: y: UDP "), "{found:?}");
        assert!(found[0].ends_with(":1 is taken by endpoint x already"), "{found:?}");
    }
    assert_found("address = 'udpin:127.0.0.2:1'", &[]);
    assert_found("address = 'udpin:127.0.0.1:1'\nenabled = false", &[]);
    let own = "endpoint.x.address = 'udpin:1?dev=lo'\nendpoint.y.address = 'udpin:1?dev=absent0'";
    assert!(!findings(own).iter().any(|it| it.contains("is taken")), "each on its interface");
    assert_found("address = 'udpin:[::1]:1'", &[]);
    assert_found("address = 'udpin:[::]:1'", &[]);
    let text = "endpoint.a.address = '/dev/null'\nendpoint.b.address = '/dev/null:9600'";
    let expected = "a.toml:2:22: warning: b: /dev/null is taken by endpoint a already";
    assert_eq!(findings(text), [expected]);
}

#[test]
fn what_has_no_effect_is_told() {
    let text = "a.toml:4:7: warning: y: option `mtu` has no effect without pack = true: \
                each frame is a datagram of its own";
    assert_found("address = 'udpin:127.0.0.1:2'\nmtu = 500", &[text]);
    let text = "a.toml:4:14: warning: y: option `queue_time` has no effect without bandwidth: \
                the link is not paced";
    assert_found("address = 'udpin:127.0.0.1:2'\nqueue_time = 1", &[text]);
    let text = "a.toml:5:20: warning: y: option `block_systems_in` has no effect beside \
                `allow_systems_in`, which does not allow any of it";
    let lists = "allow_systems_in = [1, 2]\nblock_systems_in = [3]";
    assert_found(&format!("address = 'udpin:127.0.0.1:2'\n{lists}"), &[text]);
    let texts = [
        "a.toml:3:11: warning: y: group `g` has no other member, so it has no effect",
        "a.toml:3:11: warning: y: option `prefer` has no effect without path = \"best\" in `g`",
    ];
    assert_found("address = 'udpout:127.0.0.1:2?group=g&prefer=1'", &texts);
}

#[test]
fn keys_that_nobody_uses_and_an_id_of_nobody_are_told() {
    let endpoints = "endpoint.x.address = 'udpin:127.0.0.1:1'";
    let found = findings(&format!("keys = {{ radio = '/nowhere/x' }}\n{endpoints}"));
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].starts_with("warning: key `radio`: cannot read /nowhere/x: "), "{found:?}");
    let dir = crate::test_dir::TestDir::new();
    let key = dir.write("radio.key", "a5".repeat(32));
    let closed = std::os::unix::fs::PermissionsExt::from_mode(0o600);
    std::fs::set_permissions(&key, closed).unwrap();
    let found = findings(&format!("keys = {{ radio = '{}' }}\n{endpoints}", key.display()));
    assert_eq!(found, ["warning: key `radio` is used by no endpoint"]);
    let text = "warning: `component` has no effect without `system`: the program is no component \
                of its own";
    assert_eq!(findings(&format!("component = 100\n{endpoints}")), [text]);
    assert!(findings(&format!("component = 100\nsystem = 1\n{endpoints}")).is_empty());
}

#[test]
fn too_little_to_route_is_told() {
    assert_eq!(findings(""), ["warning: there are no endpoints: nothing to join"]);
    let text =
        "a.toml:1:22: warning: y: this is the only endpoint: there is nothing to route between";
    assert_eq!(findings("endpoint.y.address = '/dev/null'"), [text]);
}

#[test]
fn messages_without_a_definition_are_wrong() {
    let text = "a.toml:4:21: y: no message is called RAW_IUM: did you mean RAW_IMU?";
    assert_found(
        "address = 'udpin:127.0.0.1:2'\nallow_messages_in = ['HEARTBEAT', 'raw_ium']",
        &[text],
    );
    let text = "a.toml:4:8: y: no message is called QQQQQ: load its definition with `dialect`";
    assert_found("address = 'udpin:127.0.0.1:2'\nrate = { QQQQQ = 1 }", &[text]);
    let found = findings("dialect = ['/absent/x.xml']\nendpoint.x.address = 'udpin:127.0.0.1:1'");
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].starts_with("cannot read /absent/x.xml: "), "{found:?}");
}

#[test]
fn endpoints_are_explained() {
    let text = "strict = true\nendpoint.fc.address = 'serial:/dev/ttyS1:57600,9600'\n\
        [endpoint.gcs]\naddress = 'udpin:14550'\nmax_peers = 3";
    let config = parse_config("a.toml", text).unwrap();
    let expected = "strict = true: send nothing to components that were never heard, not even to \
        their system's links\n\
        fc: opens /dev/ttyS1 at 57600 or 9600 baud\n\
        gcs: listens for UDP at 0.0.0.0:14550\n  \
        max_peers = 3: how many peers may be there at the same time\n";
    assert_eq!(explain(&config), expected);
}

//! FBX documents made here: nodes, takes and their layers, of any version.

use super::records::{self, Record, Value};

/// Centimeters, +Y up, +Z front, 30 frames per second.
const USUAL_SETTINGS: [(&str, i32); 7] = [
    ("UpAxis", 1),
    ("UpAxisSign", 1),
    ("FrontAxis", 2),
    ("FrontAxisSign", 1),
    ("CoordAxis", 0),
    ("CoordAxisSign", 1),
    ("TimeMode", 6),
];
/// Ticks of FBX's clock.
pub(super) const TICKS_PER_SECOND: f64 = 46_186_158_000.0;
/// Documents of older versions know objects by their names, and have their takes elsewhere.
const IDS_FROM: u32 = 7000;
/// The version that is written where a test does not care.
const USUAL_VERSION: u32 = 7400;

/// A property: its name, its type, its values.
#[derive(Clone, Debug)]
pub(super) struct Property {
    name: &'static str,
    kind: &'static str,
    values: Vec<Value>,
}

pub(super) fn vector(name: &'static str, values: [f64; 3]) -> Property {
    Property { name, kind: "Vector3D", values: values.map(Value::Number).to_vec() }
}

pub(super) fn whole(name: &'static str, value: i32) -> Property {
    Property { name, kind: "int", values: vec![value.into()] }
}

/// Which axes are up, in front and aside: the index of each, and its sign.
pub(super) fn axes(up: (usize, f64), front: (usize, f64), side: (usize, f64)) -> [Property; 6] {
    [
        whole("UpAxis", up.0 as i32),
        whole("UpAxisSign", up.1 as i32),
        whole("FrontAxis", front.0 as i32),
        whole("FrontAxisSign", front.1 as i32),
        whole("CoordAxis", side.0 as i32),
        whole("CoordAxisSign", side.1 as i32),
    ]
}

pub(super) fn number(name: &'static str, value: f64) -> Property {
    Property { name, kind: "Number", values: vec![value.into()] }
}

impl Property {
    fn record(&self, version: u32) -> Record {
        let (record, flags) = if version < IDS_FROM { ("Property", vec!["A"]) } else { ("P", vec!["", "A"]) };
        let row = flags.into_iter().fold(Record::new(record).with(self.name).with(self.kind), Record::with);
        self.values.iter().cloned().fold(row, Record::with)
    }
}

/// Properties, as a record of the version.
pub(super) fn table(properties: &[Property], version: u32) -> Record {
    let name = if version < IDS_FROM { "Properties60" } else { "Properties70" };
    Record::new(name).holding(properties.iter().map(|property| property.record(version)))
}

/// A node.
#[derive(Clone, Debug)]
struct Node {
    name: String,
    kind: &'static str,
    above: Option<usize>,
    properties: Vec<Property>,
}

impl Node {
    /// The value of a property that is animated but for this axis.
    fn own(&self, property: &str, axis: usize) -> f64 {
        let own = self.properties.iter().find(|own| own.name == property).and_then(|own| own.values.get(axis));
        match own {
            Some(Value::Number(value)) => *value,
            _ if property == "Lcl Scaling" => 1.0,
            _ => 0.0,
        }
    }
}

/// How a curve runs between its keys.
#[derive(Clone, Copy, Debug, Default)]
pub(super) enum Between {
    #[default]
    Line,
    Step,
    /// A cubic that lies flat at every key.
    Ease,
}

/// Keys of one number.
#[derive(Clone, Debug, Default)]
pub(super) struct Curve {
    /// Seconds and value.
    pub(super) keys: Vec<(f64, f64)>,
    pub(super) between: Between,
    /// The letter of FBX, and how often it is repeated; -1 is without end.
    pub(super) before: Option<(char, i32)>,
    pub(super) after: Option<(char, i32)>,
}

pub(super) fn line(keys: &[(f64, f64)]) -> Curve {
    Curve { keys: keys.to_vec(), ..Curve::default() }
}

/// What a curve is of.
#[derive(Clone, Copy, Debug)]
pub(super) enum Of {
    Node(usize),
    /// The layer that it is in.
    Layer,
    /// An object that was made beside.
    Object(i64),
}

/// Curves of one property.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    of: Of,
    property: &'static str,
    axes: Vec<(&'static str, Curve)>,
}

impl Channel {
    pub(super) fn new(of: Of, property: &'static str, axes: &[(&'static str, Curve)]) -> Self {
        Self { of, property, axes: axes.to_vec() }
    }

    /// A line on one axis of a node's property.
    pub(super) fn of(node: usize, property: &'static str, axis: &'static str, keys: &[(f64, f64)]) -> Self {
        Self::new(Of::Node(node), property, &[(axis, line(keys))])
    }
}

/// Channels on top of those of the layers before.
#[derive(Clone, Debug, Default)]
pub(super) struct Layer {
    pub(super) properties: Vec<Property>,
    pub(super) channels: Vec<Channel>,
}

#[derive(Clone, Debug)]
struct Take {
    name: &'static str,
    /// In seconds.
    span: Option<(f64, f64)>,
    layers: Vec<Layer>,
}

/// A document.
#[derive(Clone, Debug, Default)]
pub(super) struct Document {
    settings: Vec<Property>,
    nodes: Vec<Node>,
    takes: Vec<Take>,
    objects: Vec<Record>,
    connections: Vec<Record>,
}

impl Document {
    /// A document of these limbs, each below the one before.
    pub(super) fn chain(limbs: &[(&str, &[Property])]) -> Self {
        let nodes = limbs.iter().enumerate();
        nodes.fold(Self::default(), |document, (index, (name, properties))| {
            document.node(name, "LimbNode", index.checked_sub(1), properties)
        })
    }

    /// With one more node, below one that is there.
    pub(super) fn node(
        mut self,
        name: &str,
        kind: &'static str,
        above: Option<usize>,
        properties: &[Property],
    ) -> Self {
        self.nodes.push(Node { name: name.to_owned(), kind, above, properties: properties.to_vec() });
        self
    }

    /// With settings that replace the usual ones.
    pub(super) fn settings(mut self, settings: &[Property]) -> Self {
        self.settings.extend_from_slice(settings);
        self
    }

    /// With a take of one layer.
    pub(super) fn moved(self, channels: &[Channel]) -> Self {
        self.take("Take", None, &[Layer { channels: channels.to_vec(), ..Layer::default() }])
    }

    /// With a take.
    pub(super) fn take(mut self, name: &'static str, span: Option<(f64, f64)>, layers: &[Layer]) -> Self {
        self.takes.push(Take { name, span, layers: layers.to_vec() });
        self
    }

    /// With an object, and what it is connected to: other objects, or nodes by [`node_id`].
    pub(super) fn object(mut self, object: Record, id: i64, above: i64) -> Self {
        self.objects.push(object);
        self.connections.push(connection(id, above));
        self
    }

    /// With an object on a property of another one.
    pub(super) fn on_property(mut self, object: Record, id: i64, above: i64, property: &str) -> Self {
        self.objects.push(object);
        self.connections.push(connection_to_property(id, above, property));
        self
    }

    /// With one more connection.
    pub(super) fn connected(mut self, below: i64, above: i64) -> Self {
        self.connections.push(connection(below, above));
        self
    }

    /// As text.
    pub(super) fn text(&self) -> Vec<u8> {
        self.text_of(USUAL_VERSION)
    }

    /// As text of a version.
    pub(super) fn text_of(&self, version: u32) -> Vec<u8> {
        records::text(&self.records(version), version)
    }

    /// As binary of a version.
    pub(super) fn binary_of(&self, version: u32) -> Vec<u8> {
        records::binary(&self.records(version), version)
    }

    fn records(&self, version: u32) -> Vec<Record> {
        let header =
            Record::new("FBXHeaderExtension").field("FBXHeaderVersion", 1003).field("FBXVersion", version as i32);
        let replaced = |name: &str| self.settings.iter().any(|setting| setting.name == name);
        let usual = USUAL_SETTINGS.iter().filter(|(name, _)| !replaced(name)).map(|(name, value)| whole(name, *value));
        let settings: Vec<Property> = usual.chain(self.settings.iter().cloned()).collect();
        let settings = Record::new("GlobalSettings").field("Version", 1000).holding([table(&settings, version)]);
        if version < IDS_FROM {
            let (objects, connections) = self.by_name(version);
            let takes = self.takes.iter().map(|take| self.old_take(take));
            let takes =
                Record::new("Takes").field("Current", self.takes.first().map_or("", |take| take.name)).holding(takes);
            return vec![header, objects.holding([settings]), connections, takes];
        }
        let (objects, connections) = self.by_id(version);
        vec![header, settings, objects, connections]
    }

    fn by_name(&self, version: u32) -> (Record, Record) {
        let (mut objects, mut connections) = (Record::new("Objects"), Record::new("Connections"));
        for node in &self.nodes {
            objects = objects.holding([Record::new("Model")
                .with(model(&node.name))
                .with(node.kind)
                .field("Version", 232)
                .holding([table(&node.properties, version)])]);
            let above = node.above.map_or("Scene", |above| &self.nodes[above].name);
            connections =
                connections.holding([Record::new("Connect").with("OO").with(model(&node.name)).with(model(above))]);
        }
        (objects, connections)
    }

    /// What was before stacks and layers: keys of nodes, by what they are called.
    fn old_take(&self, take: &Take) -> Record {
        let mut record = Record::new("Take").with(take.name).field("FileName", "take.tak");
        if let Some((begin, end)) = take.span {
            for name in ["LocalTime", "ReferenceTime"] {
                record = record.holding([Record::new(name).with(ticks(begin)).with(ticks(end))]);
            }
        }
        let named = |name: &'static str| Record::new("Channel").with(name);
        record.holding(take.layers.iter().flat_map(|layer| &layer.channels).map(|channel| {
            let Of::Node(node) = channel.of else { panic!("old takes move nodes") };
            let letter = channel.property.trim_start_matches("Lcl ").get(..1);
            let letter = ["T", "R", "S"].into_iter().find(|known| Some(*known) == letter).expect("a transform");
            let axes = ["X", "Y", "Z"].into_iter().enumerate().map(|(index, axis)| {
                let own = self.nodes[node].own(channel.property, index);
                let curve = channel.axes.iter().find(|(moved, _)| *moved == axis).map(|(_, curve)| curve);
                named(axis).field("Default", own).holding(curve.into_iter().flat_map(Curve::old_keys))
            });
            let transform = named("Transform").holding([named(letter).holding(axes)]);
            Record::new("Model").with(model(&self.nodes[node].name)).field("Version", 1.1).holding([transform])
        }))
    }

    fn by_id(&self, version: u32) -> (Record, Record) {
        let mut objects = Record::new("Objects").holding(self.objects.iter().cloned());
        let mut connections = Record::new("Connections").holding(self.connections.iter().cloned());
        for (index, node) in self.nodes.iter().enumerate() {
            let id = node_id(index);
            objects = objects.holding([Record::new("Model")
                .with(id)
                .with(model(&node.name))
                .with(node.kind)
                .field("Version", 232)
                .holding([table(&node.properties, version)])]);
            connections = connections.holding([connection(id, node.above.map_or(0, node_id))]);
            if node.kind == "LimbNode" {
                let attribute =
                    Record::new("NodeAttribute").with(id + 1).with(Value::Name("NodeAttribute", String::new()));
                objects = objects.holding([attribute.with("LimbNode").field("TypeFlags", "Skeleton")]);
                connections = connections.holding([connection(id + 1, id)]);
            }
        }
        let mut id = 1_000_000;
        for take in &self.takes {
            id += 1;
            let stack = id;
            let span = take.span.map(|(begin, end)| {
                let time = |name, seconds| Property { name, kind: "KTime", values: vec![ticks(seconds).into()] };
                table(&[time("LocalStart", begin), time("LocalStop", end)], version)
            });
            let name = Value::Name("AnimStack", take.name.to_owned());
            objects = objects.holding([Record::new("AnimationStack").with(stack).with(name).with("").holding(span)]);
            for layer in &take.layers {
                id += 1;
                let layer_id = id;
                let name = Value::Name("AnimLayer", "Layer".to_owned());
                let properties = table(&layer.properties, version);
                objects = objects.holding([Record::new("AnimationLayer")
                    .with(layer_id)
                    .with(name)
                    .with("")
                    .holding([properties])]);
                connections = connections.holding([connection(layer_id, stack)]);
                for channel in &layer.channels {
                    (objects, connections) = self.channel(channel, layer_id, &mut id, version, objects, connections);
                }
            }
        }
        (objects, connections)
    }

    fn channel(
        &self,
        channel: &Channel,
        layer: i64,
        id: &mut i64,
        version: u32,
        objects: Record,
        connections: Record,
    ) -> (Record, Record) {
        const AXES: [(&str, &str); 5] =
            [("X", "d|X"), ("Y", "d|Y"), ("Z", "d|Z"), ("Weight", "d|Weight"), ("DeformPercent", "d|DeformPercent")];
        let name_of = |axis: &str| AXES.into_iter().find(|(known, _)| *known == axis).expect("a known axis").1;
        *id += 1;
        let node = *id;
        let (target, defaults) = match channel.of {
            Of::Node(index) => {
                let own = |axis: usize| number(AXES[axis].1, self.nodes[index].own(channel.property, axis));
                (node_id(index), (0..3).map(own).collect())
            }
            Of::Layer => (layer, vec![number("d|Weight", 0.0)]),
            Of::Object(object) => (object, vec![number(name_of(channel.property), 0.0)]),
        };
        let name = Value::Name("AnimCurveNode", String::new());
        let mut objects = objects.holding([Record::new("AnimationCurveNode")
            .with(node)
            .with(name)
            .with("")
            .holding([table(&defaults, version)])]);
        let mut connections =
            connections.holding([connection(node, layer), connection_to_property(node, target, channel.property)]);
        for (axis, curve) in &channel.axes {
            *id += 1;
            objects = objects.holding([curve.object(*id)]);
            connections = connections.holding([connection_to_property(*id, node, name_of(axis))]);
        }
        (objects, connections)
    }
}

impl Curve {
    fn extrapolations(&self) -> impl Iterator<Item = Record> {
        let sides = [("Pre-Extrapolation", self.before), ("Post-Extrapolation", self.after)];
        sides.into_iter().filter_map(|(name, mode)| {
            let (letter, times) = mode?;
            Some(Record::new(name).field("Type", letter).field("Repetition", times))
        })
    }

    fn object(&self, id: i64) -> Record {
        let flags = match self.between {
            Between::Line => 4,
            Between::Step => 2,
            // With tangents of its own.
            Between::Ease => 8 | 1024,
        };
        let (times, values) = self.keys.iter().copied().unzip::<f64, f64, Vec<f64>, Vec<f64>>();
        Record::new("AnimationCurve")
            .with(id)
            .with(Value::Name("AnimCurve", String::new()))
            .with("")
            .field("KeyVer", 4008)
            .field("KeyTime", Value::Longs(times.into_iter().map(ticks).collect()))
            .field("KeyValueFloat", Value::Numbers(values))
            .field("KeyAttrFlags", Value::Wholes(vec![flags]))
            .field("KeyAttrDataFloat", Value::Numbers(vec![0.0; 4]))
            .field("KeyAttrRefCount", Value::Wholes(vec![self.keys.len() as i32]))
            .holding(self.extrapolations())
    }

    fn old_keys(&self) -> Vec<Record> {
        let between: &[Value] = match self.between {
            Between::Line => &[Value::Letter('L')],
            Between::Step => &[Value::Letter('C'), Value::Letter('s')],
            Between::Ease => {
                &[Value::Letter('U'), Value::Letter('s'), Value::Whole(0), Value::Whole(0), Value::Letter('n')]
            }
        };
        let keys = self.keys.iter().flat_map(|(seconds, value)| {
            [Value::Long(ticks(*seconds)), Value::Number(*value)].into_iter().chain(between.iter().cloned())
        });
        let count = Record::new("KeyCount").with(self.keys.len() as i32);
        let keys = keys.fold(Record::new("Key"), Record::with);
        [Record::new("KeyVer").with(4005), count, keys].into_iter().chain(self.extrapolations()).collect()
    }
}

fn ticks(seconds: f64) -> i64 {
    (seconds * TICKS_PER_SECOND).round() as i64
}

/// The id of a node.
pub(super) const fn node_id(index: usize) -> i64 {
    1_000 + 2 * index as i64
}

fn model(name: &str) -> Value {
    Value::Name("Model", name.to_owned())
}

fn connection(below: i64, above: i64) -> Record {
    Record::new("C").with("OO").with(below).with(above)
}

fn connection_to_property(below: i64, above: i64, property: &str) -> Record {
    Record::new("C").with("OP").with(below).with(above).with(property)
}

/// A mesh of one triangle.
pub(super) fn triangle(id: i64) -> Record {
    Record::new("Geometry")
        .with(id)
        .with(Value::Name("Geometry", "Triangle".to_owned()))
        .with("Mesh")
        .field("Vertices", Value::Numbers(vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]))
        .field("PolygonVertexIndex", Value::Wholes(vec![0, 1, -3]))
}

pub(super) fn deformer(id: i64, name: &str, class: &'static str) -> Record {
    let kind = if matches!(class, "Skin" | "BlendShape") { "Deformer" } else { "SubDeformer" };
    Record::new("Deformer").with(id).with(Value::Name(kind, name.to_owned())).with(class).field("Version", 100)
}

/// What moves the second corner of the triangle by 3 along Z.
pub(super) fn shape(id: i64) -> Record {
    Record::new("Geometry")
        .with(id)
        .with(Value::Name("Geometry", "Smile".to_owned()))
        .with("Shape")
        .field("Version", 100)
        .field("Indexes", Value::Wholes(vec![1]))
        .field("Vertices", Value::Numbers(vec![0.0, 0.0, 3.0]))
}

//! Words of other languages for the parts of a body, as data, and which language a skeleton's names are in.
//!
//! Words are without accents and spaces: `avant_bras`, `AvantBras` and `avantbras` are one word here. A language counts only where
//! several names of a skeleton are in it, since many of its words mean other things elsewhere (`main`, `son`, `you`).

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::LazyLock,
};

/// Parts that have to be named in a language before its words count.
const FEWEST_PARTS: usize = 4;
/// A part is written in up to this many words.
const MAX_WORDS: usize = 3;

/// Words of one language, with what they are in the words of the lexicon.
type Words = &'static [(&'static str, &'static str)];

/// A language, by its place in [`LANGUAGES`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Language(usize);

const LANGUAGES: [Words; 8] = [FRENCH, SPANISH, PORTUGUESE, ITALIAN, GERMAN, PINYIN, KOREAN, JAPANESE];

const FRENCH: Words = &[
    ("gauche", "left"),
    ("droite", "right"),
    ("droit", "right"),
    ("g", "left"),
    ("d", "right"),
    ("os", "bone"),
    ("bassin", "pelvis"),
    ("hanches", "hips"),
    ("hanche", "hip"),
    ("colonne", "spine"),
    ("colonnevertebrale", "spine"),
    ("dos", "spine"),
    ("torse", "torso"),
    ("thorax", "thorax"),
    ("poitrine", "chest"),
    ("ventre", "abdomen"),
    ("taille", "waist"),
    ("cou", "neck"),
    ("nuque", "neck"),
    ("tete", "head"),
    ("machoire", "jaw"),
    ("oeil", "eye"),
    ("clavicule", "clavicle"),
    ("epaule", "shoulder"),
    ("bras", "arm"),
    ("brashaut", "upper arm"),
    ("hautbras", "upper arm"),
    ("avantbras", "forearm"),
    ("coude", "elbow"),
    ("poignet", "wrist"),
    ("main", "hand"),
    ("doigt", "finger"),
    ("pouce", "thumb"),
    ("majeur", "middle"),
    ("annulaire", "ring"),
    ("auriculaire", "pinky"),
    ("cuisse", "thigh"),
    ("jambe", "leg"),
    ("genou", "knee"),
    ("tibia", "shin"),
    ("mollet", "calf"),
    ("cheville", "ankle"),
    ("pied", "foot"),
    ("orteil", "toe"),
    ("orteils", "toe"),
];

const SPANISH: Words = &[
    ("izquierda", "left"),
    ("izquierdo", "left"),
    ("izq", "left"),
    ("derecha", "right"),
    ("derecho", "right"),
    ("der", "right"),
    ("hueso", "bone"),
    ("cadera", "hips"),
    ("caderas", "hips"),
    ("pelvis", "pelvis"),
    ("columna", "spine"),
    ("espina", "spine"),
    ("espalda", "spine"),
    ("pecho", "chest"),
    ("torso", "torso"),
    ("cintura", "waist"),
    ("cuello", "neck"),
    ("cabeza", "head"),
    ("mandibula", "jaw"),
    ("ojo", "eye"),
    ("clavicula", "clavicle"),
    ("hombro", "shoulder"),
    ("brazo", "arm"),
    ("brazosuperior", "upper arm"),
    ("brazoinferior", "forearm"),
    ("antebrazo", "forearm"),
    ("codo", "elbow"),
    ("muneca", "wrist"),
    ("mano", "hand"),
    ("dedo", "finger"),
    ("pulgar", "thumb"),
    ("indice", "index"),
    ("medio", "middle"),
    ("anular", "ring"),
    ("menique", "pinky"),
    ("muslo", "thigh"),
    ("pierna", "leg"),
    ("piernasuperior", "thigh"),
    ("piernainferior", "shin"),
    ("rodilla", "knee"),
    ("pantorrilla", "calf"),
    ("espinilla", "shin"),
    ("tobillo", "ankle"),
    ("pie", "foot"),
    ("dedospie", "toe"),
    ("puntapie", "toe"),
    ("punta", "toe"),
];

const PORTUGUESE: Words = &[
    ("esquerda", "left"),
    ("esquerdo", "left"),
    ("esq", "left"),
    ("direita", "right"),
    ("direito", "right"),
    ("dir", "right"),
    ("osso", "bone"),
    ("quadril", "hips"),
    ("bacia", "pelvis"),
    ("pelve", "pelvis"),
    ("coluna", "spine"),
    ("espinha", "spine"),
    ("costas", "spine"),
    ("tronco", "torso"),
    ("peito", "chest"),
    ("cintura", "waist"),
    ("pescoco", "neck"),
    ("cabeca", "head"),
    ("mandibula", "jaw"),
    ("olho", "eye"),
    ("clavicula", "clavicle"),
    ("ombro", "shoulder"),
    ("braco", "arm"),
    ("bracosuperior", "upper arm"),
    ("bracoinferior", "forearm"),
    ("antebraco", "forearm"),
    ("cotovelo", "elbow"),
    ("pulso", "wrist"),
    ("punho", "wrist"),
    ("mao", "hand"),
    ("dedo", "finger"),
    ("polegar", "thumb"),
    ("indicador", "index"),
    ("medio", "middle"),
    ("anelar", "ring"),
    ("minimo", "pinky"),
    ("coxa", "thigh"),
    ("perna", "leg"),
    ("pernasuperior", "thigh"),
    ("pernainferior", "shin"),
    ("joelho", "knee"),
    ("canela", "shin"),
    ("panturrilha", "calf"),
    ("tornozelo", "ankle"),
    ("pe", "foot"),
    ("dedospe", "toe"),
    ("pontape", "toe"),
    ("ponta", "toe"),
];

const ITALIAN: Words = &[
    ("sinistra", "left"),
    ("sinistro", "left"),
    ("sx", "left"),
    ("destra", "right"),
    ("destro", "right"),
    ("dx", "right"),
    ("osso", "bone"),
    ("bacino", "pelvis"),
    ("anca", "hip"),
    ("anche", "hips"),
    ("spina", "spine"),
    ("spinadorsale", "spine"),
    ("colonna", "spine"),
    ("schiena", "spine"),
    ("torace", "thorax"),
    ("petto", "chest"),
    ("busto", "torso"),
    ("collo", "neck"),
    ("testa", "head"),
    ("mascella", "jaw"),
    ("occhio", "eye"),
    ("clavicola", "clavicle"),
    ("spalla", "shoulder"),
    ("braccio", "arm"),
    ("bracciosuperiore", "upper arm"),
    ("braccioinferiore", "forearm"),
    ("avambraccio", "forearm"),
    ("gomito", "elbow"),
    ("polso", "wrist"),
    ("mano", "hand"),
    ("dito", "finger"),
    ("pollice", "thumb"),
    ("indice", "index"),
    ("medio", "middle"),
    ("anulare", "ring"),
    ("mignolo", "pinky"),
    ("coscia", "thigh"),
    ("gamba", "leg"),
    ("ginocchio", "knee"),
    ("stinco", "shin"),
    ("polpaccio", "calf"),
    ("caviglia", "ankle"),
    ("piede", "foot"),
    ("ditapiede", "toe"),
    ("punta", "toe"),
];

const GERMAN: Words = &[
    ("links", "left"),
    ("linke", "left"),
    ("linker", "left"),
    ("linkes", "left"),
    ("rechts", "right"),
    ("rechte", "right"),
    ("rechter", "right"),
    ("rechtes", "right"),
    ("knochen", "bone"),
    ("gelenk", "bone"),
    ("becken", "pelvis"),
    ("hufte", "hip"),
    ("huefte", "hip"),
    ("huften", "hips"),
    ("huefte", "hip"),
    ("wirbelsaule", "spine"),
    ("wirbelsaeule", "spine"),
    ("wirbel", "spine"),
    ("rucken", "spine"),
    ("ruecken", "spine"),
    ("bauch", "abdomen"),
    ("brust", "chest"),
    ("brustkorb", "chest"),
    ("oberkorper", "upper body"),
    ("hals", "neck"),
    ("nacken", "neck"),
    ("kopf", "head"),
    ("kiefer", "jaw"),
    ("auge", "eye"),
    ("schlusselbein", "clavicle"),
    ("schluesselbein", "clavicle"),
    ("schulter", "shoulder"),
    ("oberarm", "upper arm"),
    ("unterarm", "forearm"),
    ("ellbogen", "elbow"),
    ("ellenbogen", "elbow"),
    ("handgelenk", "wrist"),
    ("hand", "hand"),
    ("finger", "finger"),
    ("daumen", "thumb"),
    ("zeigefinger", "index"),
    ("mittelfinger", "middle"),
    ("ringfinger", "ring"),
    ("kleinerfinger", "pinky"),
    ("oberschenkel", "thigh"),
    ("unterschenkel", "shin"),
    ("schenkel", "thigh"),
    ("bein", "leg"),
    ("oberbein", "thigh"),
    ("unterbein", "shin"),
    ("knie", "knee"),
    ("wade", "calf"),
    ("schienbein", "shin"),
    ("knochel", "ankle"),
    ("fussgelenk", "ankle"),
    ("fuss", "foot"),
    ("zeh", "toe"),
    ("zehe", "toe"),
    ("zehen", "toe"),
];

const PINYIN: Words = &[
    ("zuo", "left"),
    ("you", "right"),
    ("gu", "bone"),
    ("gutou", "bone"),
    ("guge", "bone"),
    ("gupen", "pelvis"),
    ("penggu", "pelvis"),
    ("tunbu", "hips"),
    ("kuan", "hips"),
    ("kuanbu", "hips"),
    ("jizhui", "spine"),
    ("jizhu", "spine"),
    ("yao", "waist"),
    ("yaobu", "waist"),
    ("xiong", "chest"),
    ("xiongbu", "chest"),
    ("bozi", "neck"),
    ("jing", "neck"),
    ("jingbu", "neck"),
    ("tou", "head"),
    ("toubu", "head"),
    ("xiaba", "jaw"),
    ("yanjing", "eye"),
    ("suogu", "clavicle"),
    ("jian", "shoulder"),
    ("jianbang", "shoulder"),
    ("jianbu", "shoulder"),
    ("shoubi", "arm"),
    ("shangbi", "upper arm"),
    ("dabi", "upper arm"),
    ("qianbi", "forearm"),
    ("xiaobi", "forearm"),
    ("zhou", "elbow"),
    ("shouzhou", "elbow"),
    ("shouwan", "wrist"),
    ("shou", "hand"),
    ("shouzhi", "finger"),
    ("muzhi", "thumb"),
    ("shizhi", "index"),
    ("zhongzhi", "middle"),
    ("wumingzhi", "ring"),
    ("xiaozhi", "pinky"),
    ("tui", "leg"),
    ("datui", "thigh"),
    ("xiaotui", "shin"),
    ("xigai", "knee"),
    ("jiaowan", "ankle"),
    ("jiaohuai", "ankle"),
    ("jiao", "foot"),
    ("jiaozhi", "toe"),
    ("jiaojian", "toe"),
];

const KOREAN: Words = &[
    ("oen", "left"),
    ("oenjjok", "left"),
    ("wen", "left"),
    ("wenjjok", "left"),
    ("oreun", "right"),
    ("oreunjjok", "right"),
    ("ppyeo", "bone"),
    ("golban", "pelvis"),
    ("eongdeongi", "hips"),
    ("cheokchu", "spine"),
    ("heori", "waist"),
    ("gaseum", "chest"),
    ("mok", "neck"),
    ("meori", "head"),
    ("teok", "jaw"),
    ("nun", "eye"),
    ("swaegol", "clavicle"),
    ("eokkae", "shoulder"),
    ("pal", "arm"),
    ("sangwan", "upper arm"),
    ("wipal", "upper arm"),
    ("jeonwan", "forearm"),
    ("araepal", "forearm"),
    ("palkkumchi", "elbow"),
    ("sonmok", "wrist"),
    ("son", "hand"),
    ("songarak", "finger"),
    ("eomji", "thumb"),
    ("geomji", "index"),
    ("jungji", "middle"),
    ("yakji", "ring"),
    ("soji", "pinky"),
    ("dari", "leg"),
    ("heobeokji", "thigh"),
    ("jongari", "shin"),
    ("jeonggangi", "shin"),
    ("mureup", "knee"),
    ("balmok", "ankle"),
    ("bal", "foot"),
    ("balgarak", "toe"),
];

const JAPANESE: Words = &[
    ("hidari", "left"),
    ("migi", "right"),
    ("hone", "bone"),
    ("kotsuban", "pelvis"),
    ("koshi", "hips"),
    ("sebone", "spine"),
    ("senaka", "spine"),
    ("mune", "chest"),
    ("hara", "abdomen"),
    ("kubi", "neck"),
    ("atama", "head"),
    ("ago", "jaw"),
    ("me", "eye"),
    ("sakotsu", "clavicle"),
    ("kata", "shoulder"),
    ("ude", "arm"),
    ("jouwan", "upper arm"),
    ("zenwan", "forearm"),
    ("hiji", "elbow"),
    ("tekubi", "wrist"),
    ("te", "hand"),
    ("yubi", "finger"),
    ("oyayubi", "thumb"),
    ("hitosashiyubi", "index"),
    ("nakayubi", "middle"),
    ("kusuriyubi", "ring"),
    ("koyubi", "pinky"),
    ("ashi", "leg"),
    ("futomomo", "thigh"),
    ("momo", "thigh"),
    ("sune", "shin"),
    ("hiza", "knee"),
    ("ashikubi", "ankle"),
    ("tsumasaki", "toe"),
];

/// Every word with the languages that have it.
static WORDS: LazyLock<BTreeMap<&'static str, Vec<(Language, &'static str)>>> = LazyLock::new(|| {
    let mut words: BTreeMap<&str, Vec<(Language, &str)>> = BTreeMap::new();
    for (index, language) in LANGUAGES.into_iter().enumerate() {
        for (word, english) in language {
            words.entry(word).or_default().push((Language(index), english));
        }
    }
    words
});

impl Language {
    /// The language that the names of a skeleton are in; nothing where it is none of those that are known. `names` are the words of
    /// each name, in lower case and without accents.
    pub(super) fn of_names(names: &[Vec<String>]) -> Option<Self> {
        let mut parts: BTreeMap<Self, BTreeSet<&str>> = BTreeMap::new();
        for words in names {
            for reading in readings(words) {
                for (language, part) in lookup(&reading).filter(|word| !["left", "right", "bone"].contains(&word.1)) {
                    parts.entry(language).or_default().insert(part);
                }
            }
        }
        let most = parts.into_iter().max_by_key(|(language, parts)| (parts.len(), std::cmp::Reverse(*language)))?;
        (most.1.len() >= FEWEST_PARTS).then_some(most.0)
    }

    /// The words of a name in the words of the lexicon; what is not known stays as it is.
    pub(super) fn translate(self, words: &[String]) -> Vec<String> {
        let mut translated = Vec::new();
        let mut place = 0;
        while place < words.len() {
            let known = (1..=MAX_WORDS.min(words.len() - place)).rev().find_map(|count| {
                let english = self.english(&words[place..place + count].concat())?;
                Some((count, english))
            });
            let glued = || self.unglue(&words[place]).map(|english| (1, english));
            match known.or_else(glued) {
                Some((count, english)) => {
                    translated.extend(english.split(' ').map(str::to_owned));
                    place += count;
                }
                None => {
                    translated.push(words[place].clone());
                    place += 1;
                }
            }
        }
        translated
    }

    fn english(self, word: &str) -> Option<String> {
        lookup(word).find(|(language, _)| *language == self).map(|(_, english)| english.to_owned())
    }

    /// A part and a side in one word: `brasgauche`.
    fn unglue(self, word: &str) -> Option<String> {
        let sides =
            LANGUAGES[self.0].iter().filter(|(word, english)| ["left", "right"].contains(english) && word.len() > 1);
        sides.into_iter().find_map(|(side, english)| {
            let part = word.strip_prefix(side).or_else(|| word.strip_suffix(side))?;
            Some(format!("{english} {}", self.english(part)?))
        })
    }
}

/// What one to three words of a name in a row are together.
fn readings(words: &[String]) -> impl Iterator<Item = String> + '_ {
    (0..words.len()).flat_map(move |place| {
        let most = MAX_WORDS.min(words.len() - place);
        (1..=most).map(move |count| words[place..place + count].concat())
    })
}

fn lookup(word: &str) -> impl Iterator<Item = (Language, &'static str)> + use<> {
    WORDS.get(word).into_iter().flatten().copied()
}

/// A word without accents and in lower case.
pub(super) fn without_accents(word: &str) -> String {
    let mut plain = String::with_capacity(word.len());
    for character in word.chars().flat_map(char::to_lowercase) {
        match character {
            'à' | 'á' | 'â' | 'ã' | 'ä' | 'å' => plain.push('a'),
            'ç' => plain.push('c'),
            'è' | 'é' | 'ê' | 'ë' => plain.push('e'),
            'ì' | 'í' | 'î' | 'ï' => plain.push('i'),
            'ñ' => plain.push('n'),
            'ò' | 'ó' | 'ô' | 'õ' | 'ö' => plain.push('o'),
            'ù' | 'ú' | 'û' | 'ü' => plain.push('u'),
            'œ' => plain.push_str("oe"),
            'ß' => plain.push_str("ss"),
            other => plain.push(other),
        }
    }
    plain
}

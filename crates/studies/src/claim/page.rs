//! The sentences of a page of the book.

use super::guarantee::Guarantee;

/// The sentences of a page in Markdown, without formulas on lines of their own. A row of a table is a sentence.
pub(super) fn sentences(page: &str) -> Vec<String> {
    let mut blocks: Vec<String> = vec![String::new()];
    let mut inside = Inside::Text;
    for line in page.lines() {
        match (inside, line.trim()) {
            (Inside::Text, "\\\\[") => inside = Inside::Formula,
            (Inside::Formula, "\\\\]") => {
                blocks.pop();
                blocks.last_mut().expect("text is before a formula").push_str(" …");
                inside = Inside::Continued;
            }
            (Inside::Formula, _) => {}
            (Inside::Continued, "") => inside = Inside::Text,
            (_, "") => blocks.push(String::new()),
            (_, heading) if heading.starts_with('#') => {}
            (_, rule) if rule.starts_with("|---") => {
                blocks.pop();
                blocks.push(String::new());
            }
            (_, row) if row.starts_with('|') => blocks.push(row.into()),
            (_, item) if item.starts_with("- ") => blocks.push(item[2..].into()),
            (_, text) => {
                let block = blocks.last_mut().expect("there is one");
                *block = format!("{block} {text}").trim().into();
            }
        }
    }
    blocks.iter().flat_map(|block| split(block)).collect()
}

/// Where a line is.
#[derive(Clone, Copy)]
enum Inside {
    Text,
    Formula,
    /// After a formula in the middle of a sentence.
    Continued,
}

/// The sentences of a paragraph.
fn split(block: &str) -> Vec<String> {
    let mut sentences = vec![String::new()];
    for word in block.split_whitespace() {
        let sentence = sentences.last_mut().expect("there is one");
        *sentence = format!("{sentence} {word}").trim().into();
        if word.ends_with('.') || word.ends_with(".**") {
            sentences.push(String::new());
        }
    }
    // A title in bold letters belongs to what it entitles.
    let mut whole: Vec<String> = Vec::new();
    for sentence in sentences.into_iter().filter(|sentence| !sentence.is_empty()) {
        match whole.last_mut() {
            Some(title) if title.ends_with(".**") => *title = format!("{title} {sentence}"),
            _ => whole.push(sentence),
        }
    }
    whole
}

/// The guarantees that hold a sentence.
pub(super) fn held(sentence: &str) -> Vec<Guarantee> {
    let holds = |guarantee: &Guarantee| {
        guarantee.facts().sentences.iter().any(|part| plain(sentence).contains(&plain(part)))
    };
    Guarantee::ALL.into_iter().filter(holds).collect()
}

/// A sentence with one backslash where the book has two.
pub(super) fn plain(text: &str) -> String {
    text.replace("\\\\", "\\")
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "# A page\n\n| a | b |\n|---|---|\n| one | two |\n\n**Title.** Here\n\n\\\\[\nx^2,\n\\\\]\n\n\
        without drift. A second\none ends.\n\n- An item of 1.5 lines.\n- Another.\n";

    /// The chapters of the table of contents are those of the introduction, in its order, and their programs are tests.
    #[test]
    fn the_introduction_lists_the_chapters_of_the_book() {
        let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
        let read = |path: &str| std::fs::read_to_string(format!("{root}/{path}")).expect(path);
        let [summary, introduction] =
            ["SUMMARY", "introduction"].map(|name| read(&format!("book/src/{name}.md")));
        // `- [Title](file.md)` and `| [Title](file.md) | … |`.
        let chapters = |page: &str, first: &str| -> Vec<String> {
            let lines = page.lines().filter_map(|line| line.strip_prefix(first));
            lines.filter_map(|line| Some(line.split_once(')')?.0.to_owned())).collect()
        };
        let listed = chapters(&summary, "- [");
        assert!(listed.len() > 15, "{listed:?}");
        assert_eq!(chapters(&introduction, "| ["), listed);
        let programs = read("tests/book.rs");
        for chapter in &listed {
            let file = chapter.split('(').nth(1).expect("a link");
            let has_programs = read(&format!("book/src/{file}")).contains("```rust\n");
            assert!(
                !has_programs || programs.contains(&format!("/{file}")),
                "{file} is not tested"
            );
        }
    }

    #[test]
    fn a_page_is_its_sentences_and_the_rows_of_its_tables() {
        let expected = [
            "| one | two |",
            "**Title.** Here … without drift.",
            "A second one ends.",
            "An item of 1.5 lines.",
            "Another.",
        ];
        assert_eq!(sentences(PAGE), expected);
    }
}

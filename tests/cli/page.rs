//! Blocks of code, commands and words in code of a page.

use pulldown_cmark::{CodeBlockKind, Event, Parser, Tag, TagEnd};

/// A block of code with the word behind its fence.
pub struct Block {
    pub language: String,
    pub text: String,
}

/// Blocks between fences, in the order of the page.
pub fn blocks(page: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut open: Option<Block> = None;
    for event in Parser::new(page) {
        match event {
            Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(language))) => {
                open = Some(Block { language: language.into_string(), text: String::new() });
            }
            Event::Text(part) => {
                if let Some(block) = &mut open {
                    block.text.push_str(&part);
                }
            }
            Event::End(TagEnd::CodeBlock) => blocks.extend(open.take()),
            _ => {}
        }
    }
    blocks
}

/// Commands of the shell blocks: one a line without its comment, where the line ends in `\` with the next.
pub fn commands(page: &str) -> Vec<String> {
    let shell = blocks(page).into_iter().filter(|block| block.language == "sh");
    let joined = shell.map(|block| block.text.replace("\\\n", " "));
    let lines: Vec<String> =
        joined.flat_map(|text| text.lines().map(str::to_owned).collect::<Vec<_>>()).collect();
    let words = |line: &String| {
        let line = if line.starts_with('#') { "" } else { line.split(" # ").next().unwrap() };
        line.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    lines.iter().map(words).filter(|command| !command.is_empty()).collect()
}

/// What stands in code within the text, and every line of the blocks.
pub fn code(page: &str) -> Vec<String> {
    let mut code: Vec<String> = commands(page);
    for event in Parser::new(page) {
        if let Event::Code(span) = event {
            code.push(span.replace('\n', " "));
        }
    }
    let plain = blocks(page).into_iter().filter(|block| block.language != "sh");
    code.extend(plain.flat_map(|block| block.text.lines().map(str::to_owned).collect::<Vec<_>>()));
    code
}
